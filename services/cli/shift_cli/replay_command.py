"""``shift-mesh replay``: publish a recording again, in a session of its own."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from shift_schemas.registry import SUBJECTS
from shift_schemas.shards import MOST_SHARDS

if TYPE_CHECKING:
    from shift_analysis.input_replay import RecordedInputs, ReplayedDecisions
    from shift_recording.replay import Extent, Pacer, Publish, Replay
    from shift_recording.replay_control import ControlledReplay
    from shift_runtime.rest_client import RestClient

LISTEN = "tcp/127.0.0.1:0"
"""As a peer: a session that listens nowhere waits for its router for ever."""
CONNECT_WAIT_S = 5.0
"""How long the router may take to be reached; chosen, as the mesh's start."""
START_KEYS, TOGGLE_KEYS, STEP_KEY = "\n\r", "p ", "s"


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
    duration: Annotated[
        float, typer.Option(help="Replay so many seconds; 0: to the end.", min=0, envvar="SHIFT_DURATION")
    ] = 0.0,
    remap: Annotated[
        list[str] | None,
        typer.Option(help="OLD:=NEW publishes a topic under another name; repeatable.", envvar="SHIFT_REMAP"),
    ] = None,
    inputs: Annotated[
        bool,
        typer.Option("--inputs", help="Give only the inputs to the mesh, which decides anew.", envvar="SHIFT_INPUTS"),
    ] = False,
    url: Annotated[str, typer.Option(help="The gateway, for --inputs.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
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
    pauses and continues, s replays one message and pauses; Ctrl-C ends the replay. PATCH /v1/replays/SESSION does
    the same and more (docs/recording.md).

    With --inputs, gaze, reports and changes go to a new session of the mesh in the recorded order, and the mesh decides
    anew. Exit code 1: a decision differs from the recorded one.

    \b
    shift-mesh replay data/recordings/s1.mcap
    shift-mesh replay s1.mcap --speed 10 --topics decision,performance --remap decision:=decision_before
    shift-mesh replay s1.mcap --start-offset 60 --duration 30 --start-paused --session again
    shift-mesh replay s1.mcap --inputs --speed 100
    """
    import asyncio

    from shift_recording.replay import Replay, extent_of, replay_session

    extent = extent_of(file, longest_pause)
    wanted = tuple(name.strip() for name in topics.split(",") if name.strip()) or SUBJECTS
    plan = Replay(
        file, session or replay_session(extent.session), speed, start_offset, wanted, loop, longest_pause, duration,
        _renamed(remap or []),
    )  # fmt: skip
    _check_plan(plan, extent)
    if inputs:
        _check_inputs(plan)
        raise typer.Exit(asyncio.run(_run_inputs(plan, zenoh, url, start_paused, shards)))
    published = asyncio.run(_run(plan, extent, zenoh, start_paused, shards))
    typer.echo(f"{published} messages replayed under session {plan.session}", err=True)


def _renamed(pairs: list[str]) -> dict[str, str]:
    """Return the topics to rename. Raise :class:`InvalidSettings` for what is not a pair."""
    from shift_schemas.errors import InvalidSettings

    found = {}
    for pair in pairs:
        old, middle, new = pair.partition(":=")
        if not middle:
            raise InvalidSettings(f"--remap is {pair!r}: write OLD:=NEW, such as decision:=decision_before")
        found[old] = new
    return found


def _check_inputs(plan: Replay) -> None:
    """Refuse the options that would leave out inputs, since a session needs all of them."""
    from shift_schemas.errors import InvalidSettings

    given = {"--topics": plan.topics != SUBJECTS, "--start-offset": plan.start_offset_s, "--loop": plan.loop,
             "--duration": plan.duration_s, "--remap": plan.remap}  # fmt: skip
    if wrong := [name for name, value in given.items() if value]:
        raise InvalidSettings(f"{', '.join(wrong)} cannot be used with --inputs: a session needs all of its inputs")


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
    import signal

    from shift_recording.replay import Pacer, check_free
    from shift_recording.replay_control import ControlledReplay
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
        control = ControlledReplay(
            plan.session, plan.path.name, extent.length_s, pacer, playing.cancel, lambda: counted[0]
        )
        with _controlled(bus, control), _keys(pacer, playing), contextlib.suppress(asyncio.CancelledError):
            await playing
    finally:
        await bus.close()
    return counted[0]


async def _run_inputs(plan: Replay, zenoh: str, url: str, start_paused: bool, shards: int) -> int:
    """Give the inputs to the mesh, and return the exit code."""
    import asyncio
    import signal

    from shift_analysis.input_replay import length_of, read_inputs
    from shift_recording.replay import Pacer
    from shift_recording.replay_control import ControlledReplay
    from shift_runtime.bus.zenoh import ZenohBus
    from shift_runtime.rest_client import RestClient
    from shift_schemas.shards import Shard, shard_of

    recorded = read_inputs(plan.path)
    length_s = length_of(recorded, plan.longest_pause_s)
    bus = await ZenohBus.open(zenoh, LISTEN, Shard(shard_of(plan.session, shards), shards).name)
    loop, counted = asyncio.get_running_loop(), [0]
    try:
        await _connected(bus, zenoh)
        pacer = Pacer(plan.rate, loop.time, paused=start_paused)
        with RestClient(url) as rest:
            playing = asyncio.create_task(_giving(plan, recorded, rest, pacer, length_s, counted))
            for number in (signal.SIGINT, signal.SIGTERM):
                loop.add_signal_handler(number, playing.cancel)
            control = ControlledReplay(
                plan.session, plan.path.name, length_s, pacer, playing.cancel, lambda: counted[0], inputs=True
            )
            with _controlled(bus, control), _keys(pacer, playing), contextlib.suppress(asyncio.CancelledError):
                await playing
    finally:
        await bus.close()
    if playing.cancelled():
        typer.echo(f"ended after {counted[0]} of {len(recorded.inputs)} inputs, in session {plan.session}", err=True)
        return 1
    return _show_decisions(playing.result(), plan.session)


def _show_decisions(found: ReplayedDecisions, session: str) -> int:
    same = found.made - len(found.different)
    typer.echo(f"{same} of {found.made} decisions are the recorded ones; session {session} goes on until it is ended")
    if found.different:
        typer.echo(f"the first different one is {found.different[0]}")
    if found.different and found.late:
        typer.echo(
            f"{found.late} recorded decisions were made before all of their inputs had been read (stale, or the last "
            "policy); they and what follows from them can differ"
        )
    return 1 if found.different else 0


async def _giving(
    plan: Replay, recorded: RecordedInputs, rest: RestClient, pacer: Pacer, length_s: float, counted: list[int]
) -> ReplayedDecisions:
    from shift_analysis.input_replay import replay_inputs

    with _progress_bar(plan, length_s, counted) as shown:
        return await replay_inputs(recorded, rest, plan.session, plan.path.name, pacer, plan.longest_pause_s, shown)


@contextlib.contextmanager
def _controlled(bus: Any, control: ControlledReplay) -> Iterator[None]:
    """Let REST and other programs control the replay, and publish its status."""
    import asyncio

    handle = control.serve(bus)

    async def publish() -> None:
        while True:
            await control.publish_once(bus)

    publishing = asyncio.create_task(publish())
    try:
        yield
    finally:
        publishing.cancel()
        handle.close()


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
    from shift_recording.replay import play

    with _progress_bar(plan, extent.length_s, counted) as shown:
        return await play(_waiting_put(bus), plan, extent, pacer, shown)


@contextlib.contextmanager
def _progress_bar(plan: Replay, length_s: float, counted: list[int]) -> Iterator[Callable[[float, int], None]]:
    """Show the position; yield the function that is called with the position and the number of messages so far."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} of {task.total:.1f} s"))
    with Progress(*columns, TimeElapsedColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task(f"{plan.path.name} at {plan.rate:g}x as {plan.session}", total=length_s)

        def shown(position_s: float, published: int) -> None:
            counted[0] = published
            bar.update(task, completed=position_s)

        yield shown


def _keys(pacer: Pacer, playing: Any) -> Any:
    """Return what the user types: keys on a terminal; otherwise one line, if the replay waits to start."""
    import sys

    if sys.stdin is not None and sys.stdin.isatty():
        return _terminal(pacer)
    return _line(pacer, playing) if pacer.paused else contextlib.nullcontext()


def _terminal(pacer: Pacer) -> Any:
    import asyncio
    import os
    import sys
    import termios
    import tty

    @contextlib.contextmanager
    def held() -> Iterator[None]:
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        loop = asyncio.get_running_loop()

        def typed() -> None:
            for key in os.read(descriptor, 64).decode(errors="replace").lower():
                if key == STEP_KEY:
                    pacer.step()
                elif key in TOGGLE_KEYS or (key in START_KEYS and pacer.paused):
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
