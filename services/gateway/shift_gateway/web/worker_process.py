"""Work that takes long, in a process of its own: with progress, and it can be cancelled.

``nicegui.run.cpu_bound`` has neither: its pool keeps its processes, and forks them from a gateway with threads. A
process here lives as long as its work, with a low priority, so that the gateway keeps answering.

The function gets a ``send`` and its arguments, and sends any number of parts. The parts should be small: each one is
unpacked in the gateway's event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import os
import pickle
import struct
import sys
from collections.abc import AsyncGenerator, Callable
from typing import Any, ClassVar, NamedTuple

from shift_schemas.errors import ShiftError, Unavailable

NICENESS = 10
"""How much the process steps back behind the services; chosen."""
AT_ONCE = asyncio.Semaphore(2)
"""More work than this waits, whoever asked for it; chosen: the gateway's machine also runs the sessions."""
_HEAD = struct.Struct("<I")

Send = Callable[[object], None]
"""Hands a part to the gateway."""


class WorkFailed(Unavailable):
    """The work could not be completed."""

    title: ClassVar[str] = "The work could not be completed"


class Progress(NamedTuple):
    """How much of the work is done, 0..1."""

    share: float


class _Failed(NamedTuple):
    """The end of a work that raised an error."""

    detail: str


async def parts_of(function: str, *arguments: str) -> AsyncGenerator[Any, None]:
    """Run ``module:function`` in a process, and yield what it sends. Leaving the iteration ends the process.

    Raises
    ------
    WorkFailed
        The function raised an error, or its process was killed.
    """
    async with AT_ONCE:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", __name__, function, json.dumps(arguments),
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )  # fmt: skip
        assert process.stdout is not None
        try:
            async for part in _parts(process.stdout):
                yield part
            if code := await process.wait():
                raise WorkFailed(f"its process stopped early (exit code {code})")
        finally:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()


async def _parts(stream: asyncio.StreamReader) -> AsyncGenerator[Any, None]:
    while True:
        try:
            (length,) = _HEAD.unpack(await stream.readexactly(_HEAD.size))
            part = pickle.loads(await stream.readexactly(length))
        except asyncio.IncompleteReadError:
            return
        if isinstance(part, _Failed):
            raise WorkFailed(part.detail)
        yield part


def main() -> None:
    """Run the function that the command line names, in the process of its own."""
    os.nice(NICENESS)
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the function prints does not get between the parts

    def send(part: object) -> None:
        data = pickle.dumps(part, pickle.HIGHEST_PROTOCOL)
        output.write(_HEAD.pack(len(data)) + data)
        output.flush()

    module, _, name = sys.argv[1].partition(":")
    try:
        getattr(importlib.import_module(module), name)(send, *json.loads(sys.argv[2]))
    except BrokenPipeError:
        os._exit(0)  # nobody wants the result any more
    except ShiftError as e:
        send(_Failed(e.detail))
    except Exception as e:
        send(_Failed(f"{type(e).__name__}: {e}"))
        raise


if __name__ == "__main__":
    # pickle names classes by their module, which is not ``__main__`` for the gateway
    importlib.import_module("shift_gateway.web.worker_process").main()
