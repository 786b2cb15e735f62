"""One evaluation in a process of its own: ``shift-mesh evaluate``, with progress, and it can be cancelled."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import sys
from collections.abc import Callable
from typing import Any

from shift_schemas.errors import Conflict, Unavailable

from shift_gateway.web.evaluation_view import Experiment
from shift_gateway.web.worker_process import NICENESS

_STEP = re.compile(rb"(\d+) of (\d+) ")
LONGEST_LINE = 64 * 2**20
"""The largest result that is read, bytes: it is one line."""


class Evaluations:
    """The evaluations of one gateway; only one runs at a time, so that live sessions keep a processor."""

    def __init__(self) -> None:
        self._running: asyncio.subprocess.Process | None = None

    async def run(
        self, experiment: Experiment, runs: int, seed: int, on_progress: Callable[[float], None]
    ) -> dict[str, Any]:
        """Run an experiment and return its result; cancelling the task ends the process.

        Parameters
        ----------
        runs
            Simulated sessions of each row.
        on_progress
            Gets the share of the experiment that is done, 0..1.

        Raises
        ------
        Conflict
            Another evaluation runs.
        Unavailable
            The process failed, with what it said.
        """
        if self._running is not None:
            raise Conflict("another evaluation runs on this gateway; wait for its end, or cancel it")
        command = ["-m", "shift_cli.main", "evaluate", experiment, "--json", "--runs", str(runs), "--seed", str(seed)]
        process = self._running = await asyncio.create_subprocess_exec(
            sys.executable, *command, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE, limit=LONGEST_LINE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )  # fmt: skip
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        try:
            assert process.stdout is not None
            assert process.stderr is not None
            output, said = await asyncio.gather(process.stdout.read(), _said(process.stderr, on_progress))
            if await process.wait() not in (0, 1):  # 1: a point of the criterion does not hold
                raise Unavailable(f"the evaluation failed: {said or 'its process was ended'}")
            result: dict[str, Any] = json.loads(output)
            return result
        finally:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
            self._running = None


async def _said(stream: asyncio.StreamReader, on_progress: Callable[[float], None]) -> str:
    """Read the progress; return the last line that is something else."""
    last = ""
    while line := await stream.readline():
        if found := _STEP.match(line):
            on_progress(int(found[1]) / max(int(found[2]), 1))
        elif line.strip():
            last = line.decode(errors="replace").strip()[:500]
    return last
