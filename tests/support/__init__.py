"""Shared by the tests: builders of messages, meshes, peers and recordings."""
