"""``shift-mesh demo``: a dialogue in the terminal that shows the whole loop, with its own mesh if none runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from shift_simulator.options import USER_HELP, USER_METAVAR

if TYPE_CHECKING:
    from shift_runtime.rest_client import RestClient

    from shift_cli.dialogue import Dialogue

USUAL_URL = "http://127.0.0.1:8080"
START_LIMIT_S = 60.0
"""How long the mesh may take to start, seconds."""
STOP_LIMIT_S = 20.0
"""How long the mesh may take to stop, seconds; the supervisor's own limit is shorter."""


def demo(
    robot: Annotated[bool, typer.Option("--robot", help="A robot explains, and a simulated person answers.")] = False,
    study: Annotated[
        str, typer.Option(help="A study by name, such as coffee or coffee_de.", envvar="SHIFT_STUDY")
    ] = "coffee",
    user: Annotated[str, typer.Option(help=USER_HELP, envvar="SHIFT_USER", metavar=USER_METAVAR)] = "B",
    episodes: Annotated[
        int, typer.Option(help="How many explanations.", envvar="SHIFT_EPISODES", min=1, max=1000)
    ] = 10,
    seed: Annotated[
        int, typer.Option(help="Seed of the session; another one is another dialogue.", min=0, max=2**53 - 1)
    ] = 7,
    pause: Annotated[float, typer.Option(help="Seconds between two lines.", min=0.0, max=60.0)] = 1.0,
    url: Annotated[
        str | None,
        typer.Option(help=f"The gateway; left out: {USUAL_URL}, or a mesh of its own.", envvar="SHIFT_URL"),
    ] = None,
) -> None:
    """Show the whole loop in a minute: the robot explains, a simulated person answers, the mesh learns.

    If no mesh runs, the demonstration starts one in a temporary folder and removes it at the end.

    \b
    shift-mesh demo --robot
    shift-mesh demo --robot --study coffee_de --pause 0.5
    """
    from shift_schemas.errors import InvalidSettings

    if not robot:
        raise InvalidSettings(
            "say what to show: shift-mesh demo --robot is a dialogue in this terminal, and shift-mesh up --demo is a "
            "mesh with a simulated person and the web page"
        )
    from rich.console import Console
    from shift_simulator.user_files import find_user

    from shift_cli.dialogue import Dialogue

    console = Console(highlight=False, soft_wrap=True)
    dialogue = Dialogue(console, _study(study, episodes), find_user(user), episodes, pause)
    with _mesh(url, console.print) as shift:
        ended = dialogue.run(shift, seed)
        _verify(dialogue, shift, ended)
    console.print("\nNext: [bold]shift-mesh up --demo[/] has the same loop on a web page and keeps its recordings.")


def _study(name: str, episodes: int) -> dict[str, Any]:
    """Return the study as a start takes it, planned for ``episodes`` interactions: exploration ends with them."""
    from shift_runtime.study_files import find_study, unknown_study
    from shift_schemas.errors import UnknownThing
    from shift_study.loading import study_data

    folder = Path("data") / "studies"
    found = find_study(name, folder)
    if found is None:
        raise UnknownThing(f"study {name!r}: {unknown_study(name, folder)}")
    if found.study is None:
        assert found.error is not None
        raise found.error
    return study_data(found.study) | {"interactions": episodes, "require_condition": False}


def _verify(dialogue: Dialogue, shift: RestClient, ended: dict[str, Any]) -> None:
    """Verify the recording where this machine has it; otherwise say how to do it."""
    folders = sorted({str(folder) for folder in shift.ready().get("data", {}).values()})
    paths = [Path(folder) / "recordings" / str(ended["recording"]) for folder in folders]
    path = next((path for path in paths if path.is_file()), None)
    if path is None:
        dialogue.tell(f"Its recording is {ended['recording']}; check it where it is with: shift-mesh verify")
        return
    from shift_verify.verify import verify

    report = verify(path)
    checked = sum(report.checked.values())
    if report.difference is not None:
        dialogue.tell(f"NOT VERIFIED: {report.difference.sentence}")
        raise typer.Exit(1)
    dialogue.tell(f"Verified: {checked} messages were computed again from {path.name}, with no difference.")


# --- the mesh ---


@contextmanager
def _mesh(url: str | None, tell: Any) -> Iterator[RestClient]:
    """Yield a client of the mesh at ``url``, of the one at the usual place, or of one that runs for the dialogue."""
    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import Unavailable

    with RestClient(url or USUAL_URL, patience_s=15.0 if url else 0.0) as shift:
        try:
            ready = bool(shift.ready().get("ready"))
        except Unavailable:
            if url is not None:
                raise
            ready = False
    if ready or url is not None:
        tell(f"[dim]A mesh runs at {shift.url}; the dialogue uses it.[/]")
        with RestClient(shift.url) as shift:
            yield shift
        return
    tell("[dim]No mesh runs here; one is started for the dialogue.[/]")
    with _own_mesh() as own, RestClient(own) as shift:
        yield shift


@contextmanager
def _own_mesh() -> Iterator[str]:
    """Run ``shift-mesh up`` on free ports, in a temporary folder; yield its URL. Raises :class:`Unavailable`."""
    import os
    import subprocess
    import sys
    from tempfile import TemporaryDirectory

    port, router = _free_ports()
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SHIFT_")}
    with TemporaryDirectory(prefix="shift-demo-") as folder, open(Path(folder) / "log", "w+") as log:
        line = [
            *(sys.executable, "-m", "shift_cli.main", "up", "--port", str(port)),
            *("--zenoh", f"tcp/127.0.0.1:{router}", "--data", str(Path(folder) / "data")),
        ]
        process = subprocess.Popen(line, stdout=log, stderr=log, env=environment, preexec_fn=_end_with_parent())
        try:
            url = f"http://127.0.0.1:{port}"
            if not _became_ready(url, process):
                _raise_not_started(Path(folder) / "log")
            yield url
        finally:
            process.terminate()
            _wait_or_kill(process)


def _wait_or_kill(process: Any) -> None:
    import subprocess

    try:
        process.wait(STOP_LIMIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _end_with_parent() -> Any:
    """Return what the mesh calls at its start: it leaves the terminal's Ctrl-C to us, and ends if we are killed."""
    import ctypes
    import os
    import signal

    libc = ctypes.CDLL(None)

    def prepare() -> None:
        os.setsid()
        if hasattr(libc, "prctl"):
            libc.prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG

    return prepare


def _became_ready(url: str, process: Any) -> bool:
    """Wait until the mesh is ready; return False if it ends before, or after ``START_LIMIT_S``."""
    import time

    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import Unavailable

    until = time.monotonic() + START_LIMIT_S
    with RestClient(url, patience_s=0.0) as shift:
        while process.poll() is None and time.monotonic() < until:
            try:
                if shift.ready().get("ready"):
                    return True
            except Unavailable:
                pass
            time.sleep(0.1)
    return False


def _raise_not_started(log: Path) -> None:
    from shift_schemas.errors import Unavailable

    last = log.read_text(errors="replace").strip().splitlines()[-3:]
    raise Unavailable(f"the mesh did not start; its last lines: {' / '.join(last)}")


def _free_ports() -> tuple[int, int]:
    """Return two ports on which nobody listens now."""
    import socket

    with socket.socket() as first, socket.socket() as second:
        first.bind(("127.0.0.1", 0))
        second.bind(("127.0.0.1", 0))
        return int(first.getsockname()[1]), int(second.getsockname()[1])
