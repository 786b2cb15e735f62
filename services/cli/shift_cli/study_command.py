"""``shift-mesh study``: check a study file, show a study with every default, list the studies. It needs no mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table
    from shift_runtime.study_files import CheckedStudy

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode="rich", help="Check, show and list studies."
)

Data = Annotated[Path, typer.Option(help="The data folder; studies are in its folder studies.", envvar="SHIFT_DATA")]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on standard output.", envvar="SHIFT_JSON")]


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
