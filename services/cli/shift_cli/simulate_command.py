"""``shift-mesh simulate``: a simulated person at the live mesh."""

from __future__ import annotations

import json
import secrets
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer
from shift_simulator.options import LEARNER_HELP, USER_HELP, USER_METAVAR, check_learner

from shift_cli.entry import INTERRUPTED

if TYPE_CHECKING:
    from shift_runtime.rest_client import RestClient
    from shift_simulator.live import LiveEpisode
    from shift_simulator.users import User


def simulate(
    user: Annotated[str, typer.Option(help=USER_HELP, envvar="SHIFT_USER", metavar=USER_METAVAR)] = "A",
    episodes: Annotated[
        int, typer.Option(help="How many interactions.", envvar="SHIFT_EPISODES", min=1, max=1_000_000)
    ] = 100,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the session.", envvar="SHIFT_SEED", min=0, max=2**53 - 1)
    ] = None,
    learner: Annotated[
        str | None, typer.Option(help=LEARNER_HELP, envvar="SHIFT_LEARNER", callback=check_learner)
    ] = None,
    session: Annotated[
        str | None, typer.Option(help="Id of the session; left out: a new one.", envvar="SHIFT_SESSION")
    ] = None,
    url: Annotated[str, typer.Option(help="The gateway's URL.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON document on standard output.", envvar="SHIFT_JSON")
    ] = False,
) -> None:
    """Let a simulated person interact with the running mesh; then end the session, which finishes its recording.

    \b
    shift-mesh simulate --user B --episodes 100 --seed 7
    shift-mesh simulate --user docs/examples/my-user.json --learner scoring --json
    """
    from shift_runtime.rest_client import RestClient
    from shift_simulator.user_files import find_user

    known = find_user(user)
    name = session or f"simulated-{secrets.token_hex(4)}"
    study = {"study": "simulated", "interactions": episodes} | ({"learner": {"name": learner}} if learner else {})
    with RestClient(url) as shift:
        started = shift.start("P00", session=name, study=study, seed=seed)
        done = _interactions(shift, name, known, episodes)
        ended = shift.end(name)
    result = _result(started, known, done, ended)
    if as_json:
        typer.echo(json.dumps(result))
    else:
        typer.echo(
            f"user {known.user}, seed {started['seed']}: {episodes} interactions in session {name}, "
            f"cumulative reward {result['cumulative_reward']:.2f}; recording {ended['recording']}"
        )


def _interactions(shift: RestClient, session: str, user: User, episodes: int) -> list[LiveEpisode]:
    """Return all interactions. Ctrl-C ends the process with a word on the session, which stays live."""
    from rich.console import Console
    from rich.progress import track
    from shift_simulator.live import drive

    done: list[LiveEpisode] = []
    steps = drive(shift, session, user, episodes)
    try:
        for step in track(steps, f"user {user.user}", episodes, console=Console(stderr=True)):
            done.append(step)
    except KeyboardInterrupt:
        sys.stderr.write(
            f"stopped after {len(done)} of {episodes} interactions; session {session} is still live. "
            f"End it with: curl -X POST {shift.url}/v1/sessions/{session}/end\n"
        )
        raise typer.Exit(INTERRUPTED) from None
    return done


def _result(started: dict[str, Any], user: User, done: list[LiveEpisode], ended: dict[str, Any]) -> dict[str, Any]:
    return {
        "session": started["session"], "user": user.user, "seed": started["seed"], "episodes": len(done),
        "cumulative_reward": done[-1].performance["cumulative_reward"], "recording": ended["recording"],
        "decisions": [
            {
                "n": e.decision["n"], "task": e.decision["task"], "strategy": e.decision["strategy"],
                "cognitive_state": e.decision["cognitive_state"], "propensity": e.decision["propensity"],
                "explored": e.decision["explored"], "reward": e.performance["reward"],
            }
            for e in done
        ],
    }  # fmt: skip
