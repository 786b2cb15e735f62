"""The words of the SHIFT mesh: messages, keys, ids, errors and the study file.

Pure: nothing in this package opens a socket, a file or a clock. Everything that travels between
services, through a door or into a recording is defined here and nowhere else.
"""
