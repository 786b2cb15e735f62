"""``shift-mesh``: the command line. Every option is also an environment variable (``SHIFT_PORT``).

Heavy modules are imported by the command that needs them, so that ``--help`` answers at once. ``entry`` turns every
error into one sentence and an exit code.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from shift_schemas.shards import MOST_SHARDS
from shift_simulator import commands as evaluate_commands

from shift_cli import (
    demo_command,
    doctor_command,
    export_command,
    gaze_command,
    info_command,
    recover_commands,
    replay_command,
    robust_command,
    ros1_command,
    ros2_command,
    simulate_command,
    source_command,
    study_command,
    verify_command,
    whatif_command,
)

app = typer.Typer(
    name="shift-mesh",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
)


def _say_version(wanted: bool) -> None:
    if wanted:
        from shift_cli.version import version_line

        typer.echo(version_line())
        raise typer.Exit()


@app.callback()
def shift_mesh(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version, Python and the git revision.", callback=_say_version, is_eager=True
        ),
    ] = False,
) -> None:
    """How should the robot phrase its next explanation for this person, now?

    Exit codes: 0 success, 1 a check failed, 2 wrong use or the command could not be carried out, 130 after Ctrl-C.

    \b
    shift-mesh up --demo          # run the mesh here, with a simulated person
    shift-mesh doctor             # is everything reachable?
    shift-mesh simulate --help    # what a command does, its options and their environment variables
    """


@app.command()
def up(
    demo: Annotated[bool, typer.Option(help="Add a simulated person, in session demo.", envvar="SHIFT_DEMO")] = False,
    host: Annotated[str, typer.Option(help="Address of the gateway.", envvar="SHIFT_HOST")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port of the gateway.", envvar="SHIFT_PORT", min=1, max=65535)] = 8080,
    zenoh: Annotated[
        str, typer.Option(help="Endpoint of the mesh's router.", envvar="SHIFT_ZENOH")
    ] = "tcp/127.0.0.1:7447",
    data: Annotated[Path, typer.Option(help="Folder of recordings, studies and journals.", envvar="SHIFT_DATA")] = Path(
        "data"
    ),
    router: Annotated[
        str | None,
        typer.Option(help="Endpoint of a router that runs already; then none is started.", envvar="SHIFT_ROUTER"),
    ] = None,
    workers: Annotated[
        int,
        typer.Option(
            help="Workers of each service, for many people at a time; see docs/scaling.md.", min=1, max=MOST_SHARDS
        ),
    ] = 1,
) -> None:
    """Run the mesh on this machine until Ctrl-C.

    \b
    shift-mesh up                       # at http://127.0.0.1:8080
    shift-mesh up --demo --port 9000    # with a simulated person in session demo
    shift-mesh up --workers 4           # four workers of each service, on a machine with many cores
    """
    from shift_cli.up import run_up

    raise typer.Exit(run_up(demo, host, port, zenoh, data, router, workers))


@app.command()
def router() -> None:
    """Run the router alone until Ctrl-C. It listens on the endpoint in SHIFT_ROUTER_LISTEN, else tcp/127.0.0.1:7447.

    \b
    shift-mesh router
    SHIFT_ROUTER_LISTEN=tcp/0.0.0.0:7447 shift-mesh router    # for other machines as well
    """
    from shift_runtime.router import main as run_router

    run_router()


app.command("doctor")(doctor_command.doctor)
app.command("demo")(demo_command.demo)
app.command("simulate")(simulate_command.simulate)
app.command("verify")(verify_command.verify)
app.command("whatif")(whatif_command.whatif)
app.command("robust")(robust_command.robust)
app.command("info")(info_command.info)
app.command("export")(export_command.export)
app.command("recover")(recover_commands.recover)
app.command("convert")(recover_commands.convert)
app.command("replay")(replay_command.replay)
app.command("ros1", context_settings=ros2_command.CONTEXT)(ros1_command.ros1)
app.command("ros2", context_settings=ros2_command.CONTEXT)(ros2_command.ros2)
app.add_typer(gaze_command.app, name="gaze")
app.add_typer(source_command.app, name="source")
app.add_typer(study_command.app, name="study")
app.add_typer(evaluate_commands.app, name="evaluate")


def main() -> None:
    """Run the command line; see :mod:`shift_cli.entry`."""
    from shift_cli.entry import run

    run(app)


if __name__ == "__main__":
    main()
