"""``shift-mesh whatif``: recorded inputs under another study or learner."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shift_cli.recording_options import Files, Json, Scheduler, Workers, with_progress

if TYPE_CHECKING:
    from rich.table import Table
    from shift_analysis.whatif import OtherPolicy, WhatIf


def whatif(
    files: Files,
    study: Annotated[
        Path | None,
        typer.Option(help="A study file; its condition of the same name holds for a session.", envvar="SHIFT_STUDY"),
    ] = None,
    learner: Annotated[str, typer.Option(help="The name of another learner.", envvar="SHIFT_LEARNER")] = "",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for a figure, a table of the decisions, and the JSON.", envvar="SHIFT_OUT"),
    ] = None,
    workers: Workers = 0,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Decide recordings again under another study or learner, and estimate what it would have been worth.

    The estimates are off-policy: inverse propensity score, self-normalised, and doubly robust, with 95 % intervals.
    Exit code 0: every recording was decided again; 1: some were not, and the others were.

    \b
    shift-mesh whatif data/recordings --learner thompson
    shift-mesh whatif s1.mcap s2.mcap --study other.yaml --out whatif
    shift-mesh whatif data/recordings --learner scoring --json | jq .value
    """
    from shift_analysis.whatif import compare_recordings, what_if
    from shift_recording.files import recordings_in

    paths, policy = recordings_in(files), _policy(study, learner)
    compared = with_progress("deciding again", compare_recordings(paths, policy, workers, scheduler), len(paths))
    answer = what_if(compared)
    if out is not None:
        _write(answer, out, learner or (study.stem if study else "again"))
    if as_json:
        typer.echo(json.dumps(answer.as_json(), ensure_ascii=False))
    else:
        _show(answer)
    for name, problem in answer.problems.items():
        typer.echo(f"{name} was left out: {problem}", err=True)
    raise typer.Exit(1 if answer.problems else 0)


def _policy(study: Path | None, learner: str) -> OtherPolicy:
    from shift_analysis.whatif import OtherPolicy
    from shift_runtime.study_files import check_file
    from shift_schemas.errors import InvalidSettings, UnknownThing
    from shift_study.loading import study_json

    if study is None and not learner:
        raise InvalidSettings("give --study FILE, --learner NAME, or both: the policy to compare with")
    if study is None:
        return OtherPolicy(learner=learner)
    if not study.is_file():
        raise UnknownThing(f"there is no study file {study}; shift-mesh study show NAME writes a built-in study")
    found = check_file(study, str(study))
    if found.study is None:
        raise found.error or InvalidSettings("; ".join(found.mistakes))
    return OtherPolicy(study_json(found.study), learner)


def _write(answer: WhatIf, out: Path, name: str) -> None:
    from shift_analysis.figure import draw_what_if
    from shift_analysis.tables import decisions_csv, wizard_table
    from shift_recording.durable_file import write_durably

    out.mkdir(parents=True, exist_ok=True)
    write_durably(out / "whatif.json", json.dumps(answer.as_json(), ensure_ascii=False, indent=1).encode())
    write_durably(out / "decisions.csv", decisions_csv(answer).encode())
    files = ["whatif.json", "decisions.csv"]
    if answer.wizard:
        write_durably(out / "wizard.json", json.dumps(wizard_table(answer), ensure_ascii=False, indent=1).encode())
        files.append("wizard.json")
    files += [path.name for path in draw_what_if(answer, out, name)]
    typer.echo(f"wrote {', '.join(files)} to {out}/", err=True)


def _show(answer: WhatIf) -> None:
    from rich.console import Console

    console = Console()
    differ = sum(each.differs for each in answer.decisions)
    console.print(
        f"{len(answer.recordings)} recordings, {len(answer.decisions)} decisions; {differ} would have differed"
    )
    for title, counts in (("cognitive state", answer.states), ("strategy", answer.strategies)):
        console.print(_counts(title, counts))
    if answer.value:
        console.print(_values(answer))
    if answer.wizard:
        console.print(_wizard(answer))
    for warning in answer.warnings:
        console.print(f"warning: {warning}")


def _counts(title: str, counts: dict[str, list[int]]) -> Table:
    from rich.table import Table

    table = Table(title, "recorded", "other")
    for name, (logged, other) in counts.items():
        table.add_row(name.replace("_", " "), str(logged), str(other))
    return table


def _values(answer: WhatIf) -> Table:
    from rich.table import Table

    table = Table("mean reward of a decision", "estimate", "95 % interval", "effective sample size", "largest weight")
    for each in [*([answer.logged] if answer.logged else []), *answer.value]:
        interval = "-" if each.low is None or each.high is None else f"{each.low:.3f} to {each.high:.3f}"
        name = {"logged": "recorded", "dr": "doubly robust"}.get(each.estimator, each.estimator.upper())
        table.add_row(name, f"{each.estimate:.3f}", interval, f"{each.ess:.1f}", f"{each.max_weight:.2f}")
    return table


def _wizard(answer: WhatIf) -> Table:
    from rich.table import Table

    table = Table("overridden in", "overrides", "SHIFT agreed", "its probability of the person's choice", "chosen most")
    for name, state in answer.wizard.items():
        most = answer.actions[state.chosen.index(max(state.chosen))]
        agreed = f"{state.agree} ({100 * state.agree / state.overrides:.0f} %)"
        table.add_row(name.replace("_", " "), str(state.overrides), agreed, f"{state.expected:.2f}", most)
    return table
