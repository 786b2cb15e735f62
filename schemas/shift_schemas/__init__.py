"""The vocabulary of the SHIFT mesh: messages and their registry, keys, ids, errors and timestamps.

The package is pure: it opens no socket and no file, and reads no clock. Everything that travels between services, to a
client or into a recording is defined here and nowhere else.
"""
