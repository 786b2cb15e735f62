"""Readers of gaze files: one module for each format, listed in ``formats``."""
