"""Gaze from outside the mesh: readers of files, batching and forwarding."""
