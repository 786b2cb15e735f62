"""What the commands about many recordings share: their options and the progress bar."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, TypeVar

import typer
from shift_simulator.commands import Scheduler, Workers

__all__ = ["Files", "Json", "Scheduler", "Workers", "with_progress"]

Files = Annotated[list[Path], typer.Argument(help="Recordings, and folders of recordings.", envvar="SHIFT_FILES")]
Json = Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")]
Each = TypeVar("Each")


def with_progress(what: str, results: Iterable[Each], total: int) -> Iterator[Each]:
    """Yield the results, with a progress bar on standard error."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        for result in results:
            yield result
            bar.advance(task)
