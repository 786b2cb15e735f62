"""The router, at which the processes of the mesh meet. A Zenoh session in router mode is the Rust router.

``python -m shift_runtime.router`` listens on ``SHIFT_ROUTER_LISTEN`` until SIGINT or SIGTERM.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

import zenoh
from shift_schemas.errors import InvalidSettings

from shift_runtime.bus.zenoh_config import zenoh_config
from shift_runtime.endpoints import parse_endpoint
from shift_runtime.settings import DEFAULT_ROUTER


def main() -> None:
    """Open the router and wait for SIGINT or SIGTERM."""
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    listen = os.environ.get("SHIFT_ROUTER_LISTEN", DEFAULT_ROUTER)
    try:
        parse_endpoint(listen, "SHIFT_ROUTER_LISTEN")
    except InvalidSettings as e:
        sys.stderr.write(f"shift_router: {e.detail}\n")
        sys.exit(2)
    try:
        session = zenoh.open(zenoh_config("router", listen=listen))
    except zenoh.ZError as e:
        todo = "if another router runs there, stop it, or set SHIFT_ROUTER_LISTEN to another endpoint"
        sys.exit(f"the router cannot listen on {listen}: {e}; {todo}")
    print(f"router listens on {listen}", file=sys.stderr, flush=True)
    while not stop.wait(0.5):
        pass
    session.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main()
