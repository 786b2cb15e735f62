"""``python -m shift_simulator``: the simulated person of ``shift-mesh up --demo``, in session ``demo``.

By default it is user B of the paper, with one interaction every two seconds, for as long as the mesh runs. If the
session has ended, the person continues in ``demo-2``, and so on.
"""

from __future__ import annotations

import signal
import sys
import threading
from typing import Literal

import structlog
from pydantic import Field
from shift_runtime.logs import configure_logs
from shift_runtime.rest_client import RestClient
from shift_runtime.settings import MeshSettings, read_settings
from shift_schemas.errors import Conflict, ShiftError, Unavailable
from shift_schemas.lifecycle import LIVE

from shift_simulator.live import drive
from shift_simulator.users import paper_user

log = structlog.get_logger()


class DemoSettings(MeshSettings):
    """Settings of the simulated person: the gateway, the pace and the user."""

    url: str = Field(default="http://127.0.0.1:8080", description="The address of the gateway.")
    demo: bool = Field(default=True, description="Whether the simulated person is switched on.")
    demo_every_s: float = Field(default=2.0, gt=0, le=3600, description="Seconds between interactions.")
    demo_user: Literal["A", "B", "C", "D"] = Field(default="B", description="Which of the paper's users: A, B, C or D.")


def main() -> None:
    """Interact with the mesh until SIGINT or SIGTERM."""
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        settings = read_settings(DemoSettings)
        assert isinstance(settings, DemoSettings)
        configure_logs("simulator", settings)
        if settings.demo:
            _run_sessions(settings, stop)
        else:
            log.info("the simulated person is switched off by SHIFT_DEMO")
            stop.wait()
    except ShiftError as e:
        sys.stderr.write(f"shift_simulator: {e.detail}\n")
        sys.exit(2)


def _run_sessions(settings: DemoSettings, stop: threading.Event) -> None:
    number = 1
    while not stop.is_set():
        session = "demo" if number == 1 else f"demo-{number}"
        try:
            with RestClient(settings.url, patience_s=5.0) as shift:
                if shift.start("P00", session=session, study="default")["state"] != LIVE:
                    number += 1
                    continue
                log.info("the simulated person begins", session=session, user=settings.demo_user)
                for _ in drive(shift, session, paper_user(settings.demo_user), 1_000_000):
                    if stop.wait(settings.demo_every_s):
                        return
        except Conflict:
            number += 1
        except Unavailable as e:
            log.warning("waiting for the mesh", reason=e.detail)
            stop.wait(1.0)


if __name__ == "__main__":
    main()
