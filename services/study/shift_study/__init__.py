"""The study file: settings, defaults, checks and reading."""
