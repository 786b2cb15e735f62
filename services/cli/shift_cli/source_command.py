"""``shift-mesh source``: gaze of a live source, each a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shift_cli import gaze_command
from shift_cli.screen_option import screen_size

if TYPE_CHECKING:
    from shift_sources.live.feed import Feed

app = typer.Typer(no_args_is_help=True, help="Gaze from outside: Lab Streaming Layer, Pupil Labs, files.")
PATIENCE_S = 600.0
"""How long the mesh may be away while gaze waits or is dropped, s; chosen: longer than any restart."""

Session = Annotated[str, typer.Option(help="The session that gets the gaze.", envvar="SHIFT_SESSION")]
Url = Annotated[str, typer.Option(help="The gateway.", envvar="SHIFT_URL")]
Source = Annotated[str, typer.Option(help="Name of the gaze source in the session.", envvar="SHIFT_SOURCE")]
Screen = Annotated[
    str, typer.Option(help="Size of screen or scene camera in pixels, for gaze in pixels.", envvar="SHIFT_SCREEN")
]
AoiMap = Annotated[
    list[str] | None,
    typer.Option(
        help="The study's name of what the source calls an AOI: 'AOI 1=cup'; 'AOI 1=' is none. Repeatable.",
        envvar="SHIFT_AOI_MAP",
    ),
]
Chunk = Annotated[
    int, typer.Option(help="Samples of a chunk, if they come slowly enough.", envvar="SHIFT_CHUNK", min=1, max=1000)
]
URL = "http://127.0.0.1:8080"


@app.callback()
def _sources() -> None:
    """Gaze from outside."""


@app.command()
def lsl(
    session: Annotated[str, typer.Option(help="The session that gets the gaze.", envvar="SHIFT_SESSION")] = "",
    list_: Annotated[
        bool, typer.Option("--list", help="List the streams there are, and end.", envvar="SHIFT_LIST")
    ] = False,
    name: Annotated[
        str, typer.Option(help="Name of the gaze stream; left out: the only one.", envvar="SHIFT_NAME")
    ] = "",
    type_: Annotated[str, typer.Option("--type", help="Type of the stream, if not Gaze.", envvar="SHIFT_TYPE")] = "",
    markers: Annotated[
        str, typer.Option(help="Name of a stream whose texts become markers.", envvar="SHIFT_MARKERS")
    ] = "",
    aoi: Annotated[
        bool, typer.Option(help="Take AOI names from the channel ObjectId instead of points.", envvar="SHIFT_AOI")
    ] = False,
    aoi_stream: Annotated[
        str, typer.Option(help="Name of a stream whose texts are AOI names.", envvar="SHIFT_AOI_STREAM")
    ] = "",
    aoi_map: AoiMap = None,
    screen: Screen = "",
    unit: Annotated[
        str,
        typer.Option(
            help="Unit of the points, if the stream does not say it: normalised, pixels.", envvar="SHIFT_UNIT"
        ),
    ] = "",
    origin: Annotated[
        str,
        typer.Option(
            help="Where y begins, if the stream does not say it: top-left, bottom-left.", envvar="SHIFT_ORIGIN"
        ),
    ] = "",
    source: Source = "lsl",
    chunk: Chunk = 30,
    url: Url = URL,
) -> None:
    """Forward a gaze stream of Lab Streaming Layer into a session until Ctrl-C, with the stream's own time.

    \b
    shift-mesh source lsl --list
    shift-mesh source lsl --session s1                          # the only gaze stream there is
    shift-mesh source lsl --session s1 --name 'Neon Gaze' --screen 1600x1200 --markers 'Neon Events'
    """
    from shift_schemas.errors import InvalidSettings
    from shift_sources.files.options import aoi_map_of
    from shift_sources.live.lsl import LslFeed, LslOptions, found_streams
    from shift_sources.live.lsl_streams import ORIGINS, UNITS

    if list_:
        streams = found_streams()
        for stream in streams:
            typer.echo(stream.line)
        typer.echo(f"{len(streams)} streams", err=True)
        return
    for option, value, known in (("--unit", unit, UNITS), ("--origin", origin, ORIGINS)):
        if value and value not in known:
            raise InvalidSettings(f"{option} is {value!r}; there are {', '.join(known)}")
    options = LslOptions(
        name=name, type=type_, markers=markers, aoi_stream=aoi_stream, aoi=aoi,
        aoi_map=tuple(aoi_map_of(aoi_map or ()).items()), screen=screen_size(screen), unit=unit, origin=origin,
    )  # fmt: skip
    _run(lambda: LslFeed(options), session, source, chunk, url)


@app.command("lsl-outlet")
def lsl_outlet(
    session: Session,
    name: Annotated[
        str, typer.Option(help="Name of the stream; left out: SHIFT and the session.", envvar="SHIFT_NAME")
    ] = "",
    url: Url = URL,
) -> None:
    """Publish decisions, cognitive states and rewards as a marker stream of Lab Streaming Layer until Ctrl-C.

    LabRecorder then has them beside EEG. Each marker is one line of JSON.

    \b
    shift-mesh source lsl-outlet --session s1
    """
    from shift_sources.live.lsl_outlet import publish

    publish(url, session, name or f"SHIFT {session}", lambda text: typer.echo(text, err=True))


@app.command()
def pupil(
    session: Session,
    address: Annotated[
        str, typer.Option(help="Host and port of Pupil Remote.", envvar="SHIFT_ADDRESS")
    ] = "127.0.0.1:50020",
    surface: Annotated[
        str,
        typer.Option(
            help="Take points on this surface; left out: in the scene camera's picture.", envvar="SHIFT_SURFACE"
        ),
    ] = "",
    surfaces: Annotated[
        bool, typer.Option(help="Take the names of surfaces as AOI names.", envvar="SHIFT_SURFACES")
    ] = False,
    aoi_map: AoiMap = None,
    source: Source = "pupil",
    chunk: Chunk = 30,
    url: Url = URL,
) -> None:
    """Forward the gaze of Pupil Core (Pupil Capture) into a session until Ctrl-C, with Pupil's own time.

    \b
    shift-mesh source pupil --session s1 --surface screen
    shift-mesh source pupil --session s1 --surfaces --aoi-map 'coffee cup=cup'
    """
    from shift_schemas.errors import InvalidSettings
    from shift_sources.files.options import aoi_map_of
    from shift_sources.live.pupil import PupilFeed, PupilOptions

    if surface and surfaces:
        raise InvalidSettings("give either --surface or --surfaces: points on one surface, or AOI names of all")
    options = PupilOptions(address, surface, surfaces, tuple(aoi_map_of(aoi_map or ()).items()))
    _run(lambda: PupilFeed(options), session, source, chunk, url)


@app.command()
def neon(
    session: Session,
    address: Annotated[
        str, typer.Option(help="Address of the companion phone; left out: the only one.", envvar="SHIFT_ADDRESS")
    ] = "",
    screen: Annotated[
        str,
        typer.Option(
            help="Picture of the scene camera in pixels: Neon 1600x1200, Invisible 1088x1080.", envvar="SHIFT_SCREEN"
        ),
    ] = "1600x1200",
    source: Source = "neon",
    chunk: Chunk = 30,
    url: Url = URL,
) -> None:
    """Forward the gaze of Neon or Invisible into a session until Ctrl-C, with the phone's own time.

    Gaze is in the picture of the scene camera, which moves with the head: move the AOIs with it, or use a screen.

    \b
    shift-mesh source neon --session s1
    shift-mesh source neon --session s1 --address 192.168.1.20
    """
    from shift_sources.live.neon import SCENE, NeonFeed, NeonOptions

    options = NeonOptions(address, screen_size(screen) or SCENE)
    _run(lambda: NeonFeed(options), session, source, chunk, url)


app.command("file", help=(gaze_command.play.__doc__ or "").replace("gaze play", "source file"))(gaze_command.play)


def _run(open_feed: Callable[[], Feed], session: str, source: str, chunk: int, url: str) -> None:
    """Forward a feed until Ctrl-C or SIGTERM, and say what became of its samples."""
    import asyncio

    from shift_runtime.logs import configure_logs
    from shift_runtime.settings import read_settings
    from shift_schemas.errors import InvalidSettings, check_id

    if not session:
        raise InvalidSettings("say which session gets the gaze, with --session")
    check_id("--session", session)
    check_id("--source", source)
    configure_logs("source", read_settings())
    totals = asyncio.run(_forward(open_feed, session, source, chunk, url))
    typer.echo(totals.sentence, err=True)
    if totals.lost:
        raise typer.Exit(1)


async def _forward(open_feed: Callable[[], Feed], session: str, source: str, chunk: int, url: str) -> Any:
    import asyncio
    import signal

    from shift_runtime.rest_client import RestClient
    from shift_sources.gaze_forwarder import Batching
    from shift_sources.live.runner import LiveSource

    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    with RestClient(url) as asked:
        await asyncio.to_thread(asked.observation, session)
    feed = await asyncio.to_thread(open_feed)
    with RestClient(url, patience_s=PATIENCE_S) as rest:
        batching = Batching(samples=chunk, wait_s=0.05)
        return await LiveSource(feed, rest, session, source, batching).run(stop, _tell)


def _tell(about: str) -> None:
    typer.echo(about, err=True)
