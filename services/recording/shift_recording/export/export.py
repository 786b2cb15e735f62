"""Exports: recordings become the files of one format in one folder."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

from shift_schemas.errors import InvalidSettings

from shift_recording.durable_file import make_folder, write_durably
from shift_recording.export.columns import Column
from shift_recording.export.dictionary import dictionary_csv
from shift_recording.export.screen import Screen
from shift_recording.export.sources import OneRecording, OnProgress, Report, Sources, open_sources
from shift_recording.export.tables import table_columns
from shift_recording.export.vowpal_wabbit import line_of
from shift_recording.parallel import for_each

if TYPE_CHECKING:
    from shift_recording.export.arrow_tables import TableFiles

Format = Literal["csv", "parquet", "bids", "vw"]
DICTIONARY = "data-dictionary.csv"
EXTRA = "this needs pyarrow and pandas; install them with: pip install pyarrow pandas"


@dataclass(frozen=True)
class Way:
    """How the work is done; see :func:`shift_recording.parallel.for_each`."""

    workers: int = 1
    scheduler: str = ""
    on_progress: OnProgress | None = None


@dataclass(frozen=True)
class Exported:
    """The files of an export, and how many rows of each table they have."""

    files: tuple[Path, ...]
    rows: dict[str, int]
    report: Report

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        report = self.report
        return {
            "files": [str(path) for path in self.files], "rows": self.rows, "recordings": report.read,
            "excluded": report.excluded, "damaged": report.damaged,
        }  # fmt: skip


def export(
    paths: Iterable[Path],
    to: Format,
    out: Path,
    *,
    covariates: Path | None = None,
    screen: Screen | None = None,
    with_excluded: bool = False,
    way: Way = Way(),
) -> Exported:
    """Export recordings; a damaged one is reported, and the others go on.

    Parameters
    ----------
    paths
        Recordings, and folders of recordings.
    covariates
        A CSV with a column ``participant``; its other columns become columns of ``sessions``.
    screen
        The screen's size in pixels, which BIDS needs.
    way
        How the work is done; BIDS and Vowpal Wabbit are written by one process.

    Raises
    ------
    InvalidSettings
        A library or the screen's size is missing.
    UnknownThing, MalformedMessage
        A file does not exist, or the covariates are not valid.
    StorageFailed
        The disk refuses a write.
    """
    if to == "bids" and screen is None:
        raise InvalidSettings(
            "BIDS needs positions in pixels, and a recording has them from 0 to 1: give the size of the screen with "
            "--screen, such as --screen 1920x1080"
        )
    sources = open_sources(paths, covariates, with_excluded)
    make_folder(out)
    if to == "bids":
        assert screen is not None
        return _bids(sources, out, screen, way)
    if to == "vw":
        return _vowpal_wabbit(sources, out, way.on_progress)
    return _tables(sources, to, out, way)


def _tables(sources: Sources, to: str, out: Path, way: Way) -> Exported:
    try:
        from shift_recording.export.arrow_tables import TableFiles, batches
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    tables = table_columns(sources.names, sources.covariate_names)
    with TableFiles(out, to, tables) as files:
        if way.scheduler or (way.workers != 1 and len(sources.files) > 1):
            _read_elsewhere(sources, files, way)
        else:
            for recording in sources.recordings(way.on_progress):
                files.write(batches(recording, tables, files.as_text))
    write_durably(out / DICTIONARY, dictionary_csv(tables).encode())
    paths = (*(files.path(table) for table in tables), out / DICTIONARY)
    return Exported(paths, files.counts, sources.report)


def _read_elsewhere(sources: Sources, files: TableFiles, way: Way) -> None:
    """Let other processes read the recordings; each leaves its rows in a temporary file."""
    from shift_recording.export.arrow_tables import stored

    with TemporaryDirectory(dir=files.out, prefix=".parts-") as folder:
        tasks = [
            _Task(path, Path(folder) / f"{i}.part", sources.covariates, files.tables, files.as_text)
            for i, path in enumerate(sources.files)
        ]
        for i, report in enumerate(for_each(_store_rows, tasks, way.workers, way.scheduler)):
            sources.report.damaged |= report.damaged
            files.write(stored(tasks[i].part))
            tasks[i].part.unlink()
            if way.on_progress is not None:
                way.on_progress(i + 1, len(tasks))


@dataclass(frozen=True)
class _Task:
    """One recording to read, and the temporary file for its rows."""

    path: Path
    part: Path
    covariates: Mapping[str, Mapping[str, str]]
    tables: Mapping[str, tuple[Column, ...]]
    as_text: bool


def _store_rows(task: _Task) -> Report:
    """Write the rows of one recording to a temporary file; return what was damaged."""
    from shift_recording.export.arrow_tables import batches, store

    report = Report()
    rows = OneRecording(task.path, report, task.covariates)
    store(batches(rows, task.tables, task.as_text), task.part)
    return report


def _vowpal_wabbit(sources: Sources, out: Path, on_progress: OnProgress | None) -> Exported:
    lines: list[str | None] = []
    decisions = 0
    for recording in sources.recordings(on_progress):
        rows = [row for table, row in recording.rows_of(None) if table == "decisions"]
        decisions += len(rows)
        lines += map(line_of, rows)
    path = out / "decisions.vw"
    kept = [line for line in lines if line is not None]
    write_durably(path, "".join(f"{line}\n" for line in kept).encode())
    return Exported((path,), {"decisions": len(kept), "without_reward_or_propensity": decisions - len(kept)},
                    sources.report)  # fmt: skip


def _bids(sources: Sources, out: Path, screen: Screen, way: Way) -> Exported:
    try:
        from shift_recording.export.data_set import export_data_set
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    files, counts = export_data_set(sources, out, screen, way.on_progress)
    return Exported(files, counts, sources.report)
