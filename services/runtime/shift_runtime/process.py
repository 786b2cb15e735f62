"""Running a service as a process: settings, logs, bus, journal, signals; one line in ``__main__``."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Coroutine
from functools import partial
from typing import Any, NoReturn, Protocol

import structlog
from shift_schemas.errors import ShiftError

from shift_runtime.bus.zenoh import ZenohBus
from shift_runtime.claim import OwnedElsewhere
from shift_runtime.clock import SystemClock
from shift_runtime.journal import Journal
from shift_runtime.logs import configure_logs
from shift_runtime.metrics import Metrics
from shift_runtime.service.core import Core
from shift_runtime.service.extension import Extension
from shift_runtime.service.loop import Worker
from shift_runtime.settings import MeshSettings, read_settings

log = structlog.get_logger()
OWNED_ELSEWHERE = 3
"""Exit code of a service that found another mesh on its router: to start it again does not help."""


class Extend(Protocol):
    """Makes what a service adds to its worker."""

    def __call__(self, worker: Worker[Any], /, settings: MeshSettings) -> Extension:
        """Return the extension of this worker."""


def run_service(core: Core[Any], extend: Extend | None = None) -> None:
    """Run a service until SIGINT or SIGTERM; its exit code is 0 then, 2 for settings that are not valid."""
    try:
        settings = read_settings()
        configure_logs(core.name, settings)
        run_loop(serve(core, settings, extend))
    except OwnedElsewhere as e:
        sys.stderr.write(f"shift_{core.name}: {e.detail}\n")
        sys.exit(OWNED_ELSEWHERE)
    except ShiftError as e:
        sys.stderr.write(f"shift_{core.name}: {e.detail}\n")
        sys.exit(2)
    leave()


def run_loop(main: Coroutine[Any, Any, None]) -> None:
    """``asyncio.run`` on uvloop, which takes 50 us less to wake for a message; where there is none, on asyncio's."""
    try:
        import uvloop
    except ImportError:  # Windows
        asyncio.run(main)
    else:
        uvloop.run(main)


def leave() -> NoReturn:
    """End the process, all being done: a Zenoh session that could not be closed would hold it for ever."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


async def serve(core: Core[Any], settings: MeshSettings, extend: Extend | None = None) -> None:
    """The service on its bus, until a signal."""
    journal = Journal(settings.data / "state" / f"{core.name}.sqlite", core.name, core.lookups)
    bus = await ZenohBus.open(settings.zenoh, settings.listen)
    extended = partial(extend, settings=settings) if extend is not None else None
    worker = Worker(core, bus, journal, SystemClock(), Metrics(core.name), extended)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, worker.stop)
    log.info("started", router=settings.zenoh, data=str(settings.data))
    try:
        await worker.run()
    finally:
        await bus.close()
        journal.close()
        log.info("stopped")
