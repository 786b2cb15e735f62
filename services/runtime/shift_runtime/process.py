"""A service as a process: settings, logs, bus, journal and signals."""

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
from shift_schemas.shards import Shard

from shift_runtime.bus.zenoh import ZenohBus
from shift_runtime.claim import OwnedElsewhere
from shift_runtime.clock import SystemClock
from shift_runtime.journal import Journal
from shift_runtime.journal_schema import check_no_live_sessions
from shift_runtime.logs import configure_logs
from shift_runtime.metrics import Metrics
from shift_runtime.service.core import Core
from shift_runtime.service.extension import Extension
from shift_runtime.service.loop import Worker
from shift_runtime.settings import ServiceSettings, read_settings

log = structlog.get_logger()
OWNED_ELSEWHERE = 3
"""Exit code of a service that found another mesh on its router; a restart would not help."""


class Extend(Protocol):
    """Makes what a service adds to its worker."""

    def __call__(self, worker: Worker[Any], /, settings: ServiceSettings) -> Extension:
        """Return the extension of this worker."""


def run_service(core: Core[Any], extend: Extend | None = None) -> None:
    """Run a service until SIGINT or SIGTERM, then exit with 0.

    Settings or a data folder that are not valid give exit code 2, and another mesh on the router
    :data:`OWNED_ELSEWHERE`; the reason is written to standard error.
    """
    try:
        settings = read_settings(ServiceSettings)
        configure_logs(worker_name(core.name, settings.shard), settings)
        run_loop(serve(core, settings, extend))
    except OwnedElsewhere as e:
        sys.stderr.write(f"shift_{core.name}: {e.detail}\n")
        sys.exit(OWNED_ELSEWHERE)
    except ShiftError as e:
        sys.stderr.write(f"shift_{core.name}: {e.detail}\n")
        sys.exit(2)
    leave()


def worker_name(service: str, shard: Shard) -> str:
    """Return the name of a worker in logs and metrics: ``monitor``, or ``monitor 0/4`` with several shards."""
    return f"{service} {shard}" if shard.count > 1 else service


def run_loop(main: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine on uvloop, which wakes 50 us sooner for a message, or on asyncio's loop without it."""
    try:
        import uvloop
    except ImportError:  # Windows
        asyncio.run(main)
    else:
        uvloop.run(main)


def leave() -> NoReturn:
    """End the process once everything is done: a Zenoh session that could not be closed would block its exit."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


async def serve(core: Core[Any], settings: ServiceSettings, extend: Extend | None = None) -> None:
    """Run the service on its bus until a signal."""
    shard = settings.shard
    state = settings.data / "state"
    check_no_live_sessions(state, core.name, shard)
    journal = Journal(state / shard.name / f"{core.name}.sqlite", core.name, core.lookups, settings.data)
    bus = await ZenohBus.open(settings.zenoh, settings.listen, shard.name)
    extended = partial(extend, settings=settings) if extend is not None else None
    worker = Worker(core, bus, journal, SystemClock(), Metrics(worker_name(core.name, shard)), extended)
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
