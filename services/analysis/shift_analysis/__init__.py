"""Decide recordings again: under another study or learner, and with disturbed gaze."""
