"""``shift-mesh simulate``: a simulated person at the live mesh."""

from __future__ import annotations

import json
import secrets
from pathlib import Path
from typing import Annotated

import typer


def simulate(
    user: Annotated[str, typer.Option(help="A, B, C or D of the paper, or a user file.", envvar="SHIFT_USER")] = "A",
    episodes: Annotated[int, typer.Option(help="How many interactions.", envvar="SHIFT_EPISODES", min=1)] = 100,
    seed: Annotated[int | None, typer.Option(help="Seed of the session.", envvar="SHIFT_SEED", min=0)] = None,
    learner: Annotated[str | None, typer.Option(help="The learner, by its name.", envvar="SHIFT_LEARNER")] = None,
    session: Annotated[str | None, typer.Option(help="Id of the session; left out: a new one.")] = None,
    url: Annotated[str, typer.Option(help="The gateway.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """A simulated person interacts with the live mesh; then the session ends and its recording is there.

    \b
    shift-mesh simulate --user B --episodes 100 --seed 7
    shift-mesh simulate --user my-user.json --learner scoring --json
    """
    from rich.console import Console
    from rich.progress import track
    from shift_runtime.rest_client import RestClient
    from shift_simulator.live import drive
    from shift_simulator.users import paper_user, parse_user

    known = parse_user(Path(user).read_text(), user) if Path(user).is_file() else paper_user(user)
    name = session or f"simulated-{secrets.token_hex(4)}"
    study = {"study": "simulated", "interactions": episodes} | ({"learner": {"name": learner}} if learner else {})
    with RestClient(url) as shift:
        started = shift.start("P00", session=name, study=study, seed=seed)
        steps = track(drive(shift, name, known, episodes), f"user {known.user}", episodes, console=Console(stderr=True))
        done = list(steps)
        ended = shift.end(name)
    result = {
        "session": name, "user": known.user, "seed": started["seed"], "episodes": episodes,
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
    if as_json:
        typer.echo(json.dumps(result))
    else:
        typer.echo(
            f"user {known.user}, seed {started['seed']}: {episodes} interactions in session {name}, "
            f"cumulative reward {result['cumulative_reward']:.2f}; recording {ended['recording']}"
        )
