"""The simulator: people who are not there, experiments with them, and the exact best that is possible."""
