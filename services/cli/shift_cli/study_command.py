"""``shift-mesh study``: check, show, list and plan studies, and take over AOIs of Tobii. It needs no mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from shift_simulator.options import LEARNER_HELP, USER_HELP, check_learner

from shift_cli.recording_options import Json, Scheduler, Workers, with_progress

if TYPE_CHECKING:
    from rich.table import Table
    from shift_analysis.planning import Plan
    from shift_runtime.study_files import CheckedStudy
    from shift_study.study import Study

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode="rich", help="Check, show, list and plan studies."
)

Data = Annotated[Path, typer.Option(help="The data folder; studies are in its folder studies.", envvar="SHIFT_DATA")]


@app.command()
def check(
    file: Annotated[
        Path, typer.Argument(help="The study file.", exists=True, dir_okay=False, readable=True, envvar="SHIFT_FILE")
    ],
    as_json: Json = False,
) -> None:
    """Check a study file as a start would, and print its mistakes and warnings.

    Exit code 0: sessions can be started with it, also with warnings; 1: it has mistakes.

    \b
    shift-mesh study check data/studies/coffee.yaml
    shift-mesh study check my-study.yaml --json | jq .mistakes
    """
    from shift_runtime.study_files import check_file

    found = check_file(file, str(file))
    if as_json:
        _print_json({"file": str(file), "study": found.study.study if found.study else None, **_summary(found)})
    else:
        _print_findings(found)
    raise typer.Exit(1 if found.mistakes else 0)


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="The study's name, as at a start.", envvar="SHIFT_STUDY")],
    data: Data = Path("data"),
    as_json: Json = False,
) -> None:
    """Print a study with every default written out, as YAML that is a study file again; warnings go to standard error.

    Exit code 1 where the study has mistakes, 2 where there is none of that name.

    \b
    shift-mesh study show coffee
    shift-mesh study show coffee > data/studies/mine.yaml     # a copy with every value to change
    shift-mesh study show my-study --data /srv/shift --json
    """
    from shift_runtime.study_files import find_study, unknown_study
    from shift_schemas.errors import UnknownThing
    from shift_study.loading import study_data
    from shift_study.yaml_writer import write_yaml

    folder = data / "studies"
    found = find_study(name, folder)
    if found is None:
        raise UnknownThing(f"study {name!r}: {unknown_study(name, folder)} (looked for in {folder})")
    for sentence in (*found.mistakes, *(f"warning: {w}" for w in found.warnings)):
        typer.echo(sentence, err=True)
    if found.study is None:
        raise typer.Exit(1)
    if as_json:
        _print_json(study_data(found.study))
    else:
        typer.echo(write_yaml(study_data(found.study)), nl=False)


@app.command("list")
def list_(data: Data = Path("data"), as_json: Json = False) -> None:
    """List the studies that sessions can be started with: those of the data folder, and the built-in ones.

    Exit code 1 where one of them has mistakes.

    \b
    shift-mesh study list
    shift-mesh study list --data /srv/shift --json
    """
    from shift_runtime.study_files import list_studies

    folder = data / "studies"
    if not folder.is_dir():
        typer.echo(f"{folder} is not there; the built-in studies only", err=True)
    studies = list_studies(folder)
    if as_json:
        _print_json({"studies": [_summary(found) for found in studies]})
    else:
        _print_table(studies)
        for found in studies:
            for sentence in (*found.mistakes, *found.warnings):
                typer.echo(f"{found.name}: {sentence}")
    raise typer.Exit(1 if any(found.mistakes for found in studies) else 0)


@app.command()
def aois(
    file: Annotated[
        Path,
        typer.Argument(help="The AOI file (JSON).", exists=True, dir_okay=False, readable=True, envvar="SHIFT_FILE"),
    ],
    as_json: Json = False,
) -> None:
    """Print the AOIs of a Tobii Pro Lab project as the part aois of a study file; notes go to standard error.

    \b
    shift-mesh study aois scene.aois >> data/studies/mine.yaml
    shift-mesh study aois scene.aois --json
    """
    from shift_schemas.errors import MalformedMessage
    from shift_study.tobii_aois import tobii_aois
    from shift_study.yaml_writer import write_yaml

    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise MalformedMessage(f"{file.name} is not text in UTF-8; export the AOIs as JSON") from None
    found = tobii_aois(text, file.name)
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    if as_json:
        _print_json({"aois": found.aois, "notes": found.notes})
    else:
        typer.echo(write_yaml({"aois": found.aois}), nl=False)


@app.command()
def plan(
    study: Annotated[
        str, typer.Argument(help="The study's name, or its file, such as mine.yaml.", envvar="SHIFT_STUDY")
    ],
    learner: Annotated[
        str | None,
        typer.Option(help=f"{LEARNER_HELP} Compared with the study's.", envvar="SHIFT_LEARNER", callback=check_learner),
    ] = None,
    condition: Annotated[
        list[str] | None,
        typer.Option(help="Two conditions to compare, in two options.", envvar="SHIFT_CONDITION"),
    ] = None,
    user: Annotated[
        list[str] | None,
        typer.Option(help=f"{USER_HELP} Repeatable; default: generated people.", envvar="SHIFT_USER"),
    ] = None,
    sessions: Annotated[
        int, typer.Option(help="Simulated sessions.", min=10, max=100_000, envvar="SHIFT_SESSIONS")
    ] = 100,
    power: Annotated[float, typer.Option(help="The wanted power.", min=0.06, max=0.999, envvar="SHIFT_POWER")] = 0.8,
    seed: Annotated[int, typer.Option(help="Seed of the simulation.", min=0, max=2**39, envvar="SHIFT_SEED")] = 0,
    data: Data = Path("data"),
    workers: Workers = 0,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Simulate a study, and print how many sessions a comparison of two policies or a what-if needs.

    With --learner, the study is compared with itself under another learner; with two --condition, these are compared.
    The people are simulated, so the numbers are a guide. --json prints {"simulated", "means", "sds", "comparison",
    "whatif", "support", "warnings"}.

    \b
    shift-mesh study plan coffee --learner thompson
    shift-mesh study plan mine.yaml --condition control --condition adaptive --power 0.9
    """
    from shift_analysis.planning import PlannedStudy, plan_of, simulate_all
    from shift_simulator.user_files import find_user

    first, second = _policies(_one_study(study, data), learner, condition or [])
    planned = PlannedStudy(first, second, tuple(find_user(name) for name in user or ()))
    simulated = simulate_all(planned, sessions, seed, workers, scheduler)
    found = plan_of(list(with_progress("simulating sessions", simulated, sessions)), power)
    if as_json:
        _print_json({"study": study, "power": power, **found.as_json()})
    else:
        _print_plan(found, power)


def _one_study(name: str, data: Path) -> Study:
    """Return the study of a file or of a name."""
    from shift_runtime.study_files import SUFFIXES, check_file, named_study

    path = Path(name)
    found = check_file(path, name) if path.suffix.lower() in SUFFIXES else named_study(name, data / "studies")
    if found.study is None:
        assert found.error is not None
        raise found.error
    return found.study


def _policies(study: Study, learner: str | None, conditions: list[str]) -> tuple[str, str]:
    """Return the two policies to compare, as studies in JSON."""
    from shift_schemas.errors import InvalidSettings
    from shift_simulator.batched_sessions import check_actions
    from shift_study.loading import patched, study_in_force, study_json

    if (learner is None) == (not conditions):
        raise InvalidSettings("give either --learner NAME, or --condition twice: the policies to compare")
    if learner is not None:
        pair = study, patched(study, {"learner": {"name": learner}})
    elif len(conditions) == 2:
        pair = study_in_force(study, conditions[0]), study_in_force(study, conditions[1])
    else:
        raise InvalidSettings(f"--condition is given {len(conditions)} times; two conditions are compared")
    for each in pair:
        check_actions(each)
    return study_json(pair[0]), study_json(pair[1])


def _print_plan(found: Plan, power: float) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    means = " and ".join(f"{mean:.3f} (SD {sd:.3f})" for mean, sd in zip(found.means, found.sds, strict=True))
    console.print(f"{found.simulated} simulated sessions; mean reward of a decision: {means}", soft_wrap=True)
    designs = found.comparison, found.whatif
    table = Table("", "two groups of people", "what-if")
    table.add_row("effect (Cohen's d)", *(f"{design.effect:.2f}" for design in designs))
    numbers = [f"{n:,}" if n is not None else "more than 10,000" for n in (design.sessions for design in designs)]
    table.add_row(f"sessions for a power of {power:g}", f"{numbers[0]} in each group", numbers[1])
    for n in found.whatif.power:
        table.add_row(f"power with {n} sessions", *(f"{design.power[n]:.2f}" for design in designs))
    console.print(table)
    for warning in found.warnings:
        console.print(f"warning: {warning}", soft_wrap=True)


def _summary(found: CheckedStudy) -> dict[str, Any]:
    return {
        "name": found.name, "title": found.title, "place": found.place,
        "mistakes": found.mistakes, "warnings": found.warnings,
    }  # fmt: skip


def _print_json(document: Any) -> None:
    import json

    typer.echo(json.dumps(document, ensure_ascii=False))


def _print_findings(found: CheckedStudy) -> None:
    for sentence in found.mistakes:
        typer.echo(sentence)
    for sentence in found.warnings:
        typer.echo(f"warning: {sentence}")
    if found.study is None:
        typer.echo(f"{found.place}: {_counted(found.mistakes, 'mistake')}; no session can be started with it")
        return
    study = found.study
    typer.echo(
        f"{found.place}: no mistakes, {_counted(found.warnings, 'warning')}; study {study.study}: "
        f"tasks {', '.join(study.tasks or ['any'])}; AOIs {', '.join(study.aoi_names)}; "
        f"conditions {', '.join(study.conditions) or 'none'}; learner {study.learner.name}"
    )


def _counted(sentences: tuple[str, ...], what: str) -> str:
    return f"{len(sentences)} {what}{'' if len(sentences) == 1 else 's'}"


def _print_table(studies: list[CheckedStudy]) -> None:
    from rich.console import Console

    Console(width=None if Console().is_terminal else 160).print(_table(studies))


def _table(studies: list[CheckedStudy]) -> Table:
    from rich.markup import escape
    from rich.table import Table

    table = Table("name", "title", "from", "mistakes", "warnings", box=None)
    for found in studies:
        counts = str(len(found.mistakes)), str(len(found.warnings))
        table.add_row(escape(found.name), escape(found.title), escape(found.place), *counts)
    return table
