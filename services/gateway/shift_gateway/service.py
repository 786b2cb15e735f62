"""The gateway as a process: uvicorn with the application, on the Zenoh bus."""

from __future__ import annotations

import signal
import sys

import structlog
import uvicorn
from shift_runtime.bus.protocol import Bus
from shift_runtime.bus.zenoh import open_buses
from shift_runtime.clock import SystemClock
from shift_runtime.logs import configure_logs
from shift_runtime.process import leave
from shift_runtime.settings import read_settings
from shift_schemas.errors import ShiftError

from shift_gateway.app import make_app
from shift_gateway.http_protocol import GatewayProtocol
from shift_gateway.settings import GatewaySettings

log = structlog.get_logger()
GRACE_S = 3
"""How long open streams may continue after the stop signal, seconds."""


def run_gateway() -> None:
    """Run the server until SIGINT or SIGTERM. Exit with 2 if a setting is wrong."""
    try:
        settings = read_settings(GatewaySettings)
        assert isinstance(settings, GatewaySettings)
    except ShiftError as e:
        sys.stderr.write(f"shift_gateway: {e.detail}\n")
        sys.exit(2)
    configure_logs("gateway", settings)

    async def open_all() -> list[Bus]:
        return [*await open_buses(settings.zenoh, settings.listen, settings.shards)]

    app = make_app(settings, open_all, SystemClock())
    log.info("started", url=f"http://{settings.host}:{settings.port}", router=settings.zenoh)
    for number in (signal.SIGINT, signal.SIGTERM):  # uvicorn raises the signal again at its end; exit with 0
        signal.signal(number, lambda *_: None)
    uvicorn.run(
        app, host=settings.host, port=settings.port, log_level="warning", access_log=False,
        timeout_graceful_shutdown=GRACE_S, ws_max_size=256 * 1024, server_header=False, http=GatewayProtocol,
    )  # fmt: skip
    log.info("stopped")
    leave()
