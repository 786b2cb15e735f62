"""The gateway's application with its real HTTP server, in a thread, on a free port of this machine."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn
from shift_gateway.http_protocol import GatewayProtocol
from starlette.types import ASGIApp

HANG_LIMIT_S = 30.0


@contextmanager
def served(app: ASGIApp) -> Iterator[int]:
    """Serve ``app`` until the context is left. Yield the port."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        config = uvicorn.Config(app, http=GatewayProtocol, log_level="critical", lifespan="off", ws_max_size=256 * 1024)
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            end = time.monotonic() + HANG_LIMIT_S
            while not server.started and time.monotonic() < end:
                time.sleep(0.005)
            yield int(listening.getsockname()[1])
        finally:
            server.should_exit = True
            thread.join(HANG_LIMIT_S)


def answers(port: int, sent: list[bytes]) -> bytes:
    """Send the pieces. Return all that the server answers until it closes the connection."""
    with socket.create_connection(("127.0.0.1", port), HANG_LIMIT_S) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for piece in sent:
            connection.sendall(piece)
            time.sleep(0.001)  # so that most pieces arrive alone
        found = b""
        while piece := connection.recv(65536):
            found += piece
        return found
