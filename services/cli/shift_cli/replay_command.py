"""``shift-mesh replay``: publish a recording again, in a session of its own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from shift_schemas.registry import SUBJECTS
from shift_schemas.shards import MOST_SHARDS

if TYPE_CHECKING:
    from shift_recording.replay import Extent, Pacer, Publish, Replay

LISTEN = "tcp/127.0.0.1:0"
"""As a peer: a session that listens nowhere waits for its router for ever."""
CONNECT_WAIT_S = 5.0
"""How long the router may take to be reached; chosen, as the mesh's start."""
START_KEYS, TOGGLE_KEYS = "\n\r", "p "


def replay(
    file: Annotated[Path, typer.Argument(help="The recording.", exists=True, dir_okay=False, envvar="SHIFT_FILE")],
    speed: Annotated[float, typer.Option("--speed", "--rate", help="Times real time.", envvar="SHIFT_SPEED")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end.", envvar="SHIFT_LOOP")] = False,
    start_offset: Annotated[
        float, typer.Option(help="Begin so many seconds into the recording.", envvar="SHIFT_START_OFFSET")
    ] = 0.0,
    longest_pause: Annotated[
        float, typer.Option(help="Shorten longer pauses to so many seconds; 0: none.", envvar="SHIFT_LONGEST_PAUSE")
    ] = 10.0,
    topics: Annotated[
        str, typer.Option(help=f"Only these, with commas between: {', '.join(SUBJECTS)}.", envvar="SHIFT_TOPICS")
    ] = "",
    start_paused: Annotated[
        bool, typer.Option("--start-paused", help="Wait for Enter.", envvar="SHIFT_START_PAUSED")
    ] = False,
    session: Annotated[
        str, typer.Option(help="Session to replay under; left out: one of its own.", envvar="SHIFT_REPLAY_SESSION")
    ] = "",
    zenoh: Annotated[
        str, typer.Option(help="Endpoint of the mesh's router.", envvar="SHIFT_ZENOH")
    ] = "tcp/127.0.0.1:7447",
    shards: Annotated[
        int, typer.Option(help="The number of shards of the mesh.", envvar="SHIFT_SHARDS", min=1, max=MOST_SHARDS)
    ] = 1,
) -> None:
    """Publish the messages of a recording again, with their own timing, marked as a replay.

    No service applies replayed messages, so a replayed reward never reaches a learner. On a terminal, p or space
    pauses and continues; Ctrl-C ends the replay.

    \b
    shift-mesh replay data/recordings/s1.mcap
    shift-mesh replay s1.mcap --speed 10 --topics decision,performance
    shift-mesh replay s1.mcap --start-offset 60 --start-paused --session again
    """
    import asyncio

    from shift_recording.replay import Replay, extent_of, replay_session

    extent = extent_of(file, longest_pause)
    wanted = tuple(name.strip() for name in topics.split(",") if name.strip()) or SUBJECTS
    plan = Replay(file, session or replay_session(extent.session), speed, start_offset, wanted, loop, longest_pause)
    _check_plan(plan, extent)
    published = asyncio.run(_run(plan, extent, zenoh, start_paused, shards))
    typer.echo(f"{published} messages replayed under session {plan.session}", err=True)


def _check_plan(plan: Replay, extent: Extent) -> None:
    """Refuse the name of the recorded session, and say how much time the shortened pauses leave out."""
    from shift_schemas.errors import Conflict

    if plan.session == extent.session:
        raise Conflict(f"{plan.session} is the recorded session itself; a replay needs another name")
    if extent.shortened:
        typer.echo(
            f"{extent.shortened} pauses are shortened to {plan.longest_pause_s:g} s each, which leaves out "
            f"{extent.left_out_s:.0f} s (--longest-pause 0 keeps them)",
            err=True,
        )


async def _run(plan: Replay, extent: Extent, zenoh: str, start_paused: bool, shards: int) -> int:
    """Replay until the end or Ctrl-C, and return the number of messages."""
    import asyncio
    import contextlib
    import signal

    from shift_recording.replay import Pacer, check_free
    from shift_runtime.bus.zenoh import ZenohBus
    from shift_schemas.shards import Shard, shard_of

    shard = Shard(shard_of(plan.session, shards), shards)
    bus = await ZenohBus.open(zenoh, LISTEN, shard.name)
    loop = asyncio.get_running_loop()
    playing: asyncio.Task[int] | None = None
    counted = [0]
    try:
        await _connected(bus, zenoh)
        await check_free(bus, plan.session)
        pacer = Pacer(plan.rate, loop.time, paused=start_paused)
        playing = asyncio.create_task(_playing(bus, plan, extent, pacer, counted))
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, playing.cancel)
        with _keys(pacer, playing), contextlib.suppress(asyncio.CancelledError):
            await playing
    finally:
        await bus.close()
    return counted[0]


async def _connected(bus: Any, zenoh: str) -> None:
    import asyncio

    from shift_schemas.errors import Unavailable

    for _ in range(int(CONNECT_WAIT_S / 0.05)):
        if bus.session.info.routers_zid() or bus.session.info.peers_zid():
            return
        await asyncio.sleep(0.05)
    raise Unavailable(f"there is no router at {zenoh}; start the mesh, or name its router with --zenoh")


def _waiting_put(bus: Any) -> Publish:
    """Return a function that waits for slow listeners: a replay has time, while a live notification can be dropped."""
    from functools import partial

    import zenoh

    put: Publish = partial(bus.session.put, congestion_control=zenoh.CongestionControl.BLOCK)
    return put


async def _playing(bus: Any, plan: Replay, extent: Extent, pacer: Pacer, counted: list[int]) -> int:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from shift_recording.replay import play

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} of {task.total:.1f} s"))
    with Progress(*columns, TimeElapsedColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task(f"{plan.path.name} at {plan.rate:g}x as {plan.session}", total=extent.length_s)

        def shown(position_s: float, published: int) -> None:
            counted[0] = published
            bar.update(task, completed=position_s)

        return await play(_waiting_put(bus), plan, extent, pacer, shown)


def _keys(pacer: Pacer, playing: Any) -> Any:
    """Return what the user types: keys on a terminal; otherwise one line, if the replay waits to start."""
    import contextlib
    import sys

    if sys.stdin is not None and sys.stdin.isatty():
        return _terminal(pacer)
    return _line(pacer, playing) if pacer.paused else contextlib.nullcontext()


def _terminal(pacer: Pacer) -> Any:
    import asyncio
    import contextlib
    import os
    import sys
    import termios
    import tty
    from collections.abc import Iterator

    @contextlib.contextmanager
    def held() -> Iterator[None]:
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        loop = asyncio.get_running_loop()

        def typed() -> None:
            for key in os.read(descriptor, 64).decode(errors="replace").lower():
                if key in TOGGLE_KEYS or (key in START_KEYS and pacer.paused):
                    pacer.toggle()

        tty.setcbreak(descriptor)
        loop.add_reader(descriptor, typed)
        try:
            yield
        finally:
            loop.remove_reader(descriptor)
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)

    return held()


def _line(pacer: Pacer, playing: Any) -> Any:
    """Start a thread that waits for one line. The replay ends at the end of the input, as nothing can start it then."""
    import asyncio
    import contextlib
    import sys
    import threading

    loop = asyncio.get_running_loop()

    def started() -> None:
        if pacer.paused:
            pacer.toggle()

    def wait() -> None:
        line = sys.stdin.readline() if sys.stdin is not None else ""
        with contextlib.suppress(RuntimeError):  # the loop is closed: the replay was ended
            loop.call_soon_threadsafe(started if line else playing.cancel)

    threading.Thread(target=wait, daemon=True).start()
    return contextlib.nullcontext()
