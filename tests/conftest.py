"""Hypothesis without a clock: a busy machine must not fail a property."""

from hypothesis import settings

settings.register_profile("shift", deadline=None, derandomize=True)
settings.load_profile("shift")
