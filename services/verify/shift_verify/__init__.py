"""Verify a recording: derive every message again and compare."""
