"""Recordings as a library: segments, merging, reading and replay."""
