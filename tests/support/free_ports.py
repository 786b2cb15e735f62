"""Ports for the tests, which no other program takes in the meantime."""

from __future__ import annotations

import random
import socket

PORTS = range(15_000, 32_000)
"""Below the range from which Linux takes the ports of programs that leave the choice to it (32768 and up). Every
service of a mesh listens on such a port, and would now and then take the port that a test has chosen for a router."""


def free_port() -> int:
    """Return a port on which nobody listens now."""
    while True:
        port = random.SystemRandom().choice(PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
