"""Exports: recordings become the files of one format in one folder."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

from shift_schemas.errors import InvalidSettings
from shift_schemas.messages import Session

from shift_recording.durable_file import make_folder, write_durably
from shift_recording.export.bids import BidsSession, Labels, Screen, write_data_set
from shift_recording.export.columns import Column
from shift_recording.export.dictionary import dictionary_csv
from shift_recording.export.sources import OneRecording, OnProgress, Report, Sources, covariates_of, open_sources
from shift_recording.export.tables import Row, table_columns
from shift_recording.export.vowpal_wabbit import line_of
from shift_recording.parallel import for_each

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
        return _bids(sources, out, screen, way.on_progress)
    if to == "vw":
        return _vowpal_wabbit(sources, out, way.on_progress)
    return _tables(sources, to, out, way)


def _tables(sources: Sources, to: str, out: Path, way: Way) -> Exported:
    try:
        from shift_recording.export.arrow_tables import TableFiles, stored
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    tables = table_columns(sources.names, sources.covariate_names)
    with TemporaryDirectory(dir=out, prefix=".parts-") as folder, TableFiles(out, to, tables) as files:
        tasks = [
            _Task(path, Path(folder) / f"{i}.part", sources.covariates, tables, to == "csv")
            for i, path in enumerate(sources.files)
        ]
        for i, report in enumerate(for_each(_store_rows, tasks, way.workers, way.scheduler)):
            sources.report.damaged |= report.damaged
            for batch in stored(tasks[i].part):
                files.add(batch)
            tasks[i].part.unlink()
            if way.on_progress is not None:
                way.on_progress(i + 1, len(tasks))
    write_durably(out / DICTIONARY, dictionary_csv(tables).encode())
    paths = (*(files.path(table) for table in tables), out / DICTIONARY)
    return Exported(paths, files.counts, sources.report)


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
    rows = OneRecording(task.path, report, task.covariates, gaze_by_chunk=True)
    store(batches(rows, task.tables, task.as_text), task.part)
    return report


def _vowpal_wabbit(sources: Sources, out: Path, on_progress: OnProgress | None) -> Exported:
    lines, decisions = [], 0
    for table, row in sources.rows(on_progress):
        if table == "decisions":
            decisions += 1
            lines.append(line_of(row))
    path = out / "decisions.vw"
    kept = [line for line in lines if line is not None]
    write_durably(path, "".join(f"{line}\n" for line in kept).encode())
    return Exported((path,), {"decisions": len(kept), "without_reward_or_propensity": decisions - len(kept)},
                    sources.report)  # fmt: skip


class _DataSet:
    """The sessions of a BIDS data set, and what its labels stand for."""

    def __init__(self, out: Path, screen: Screen, covariates: Mapping[str, Mapping[str, str]]) -> None:
        self._out, self._screen, self._covariates = out, screen, covariates
        self._labels = {kind: Labels() for kind in ("participant", "session", "study")}
        self.people: dict[str, Row] = {}
        self.sessions: dict[str, list[Row]] = {}

    def session(self, session: Session, file: str) -> BidsSession:
        """Return the folder of a session, and note whose it is."""
        subject = self._labels["participant"].of(session.participant)
        name, study = self._labels["session"].of(session.session), self._labels["study"].of(session.study)
        given = covariates_of(session, self._covariates)
        self.people[subject] = {"participant_id": f"sub-{subject}", "pseudonym": session.participant, **given}
        named = {"session_id": f"ses-{name}", "session": session.session, "file": file}
        self.sessions.setdefault(subject, []).append(named)
        folder = self._out / f"sub-{subject}" / f"ses-{name}" / "beh"
        return BidsSession(folder, f"sub-{subject}_ses-{name}_task-{study}", self._screen)


def _bids(sources: Sources, out: Path, screen: Screen, on_progress: OnProgress | None) -> Exported:
    data_set = _DataSet(out, screen, sources.covariates)
    counts = dict.fromkeys(("sessions", "gaze", "fixations", "decisions", "performances", "markers"), 0)
    for recording in sources.recordings(on_progress):
        folder: BidsSession | None = None
        for table, row in recording:
            if folder is None and recording.rows.session is not None:
                folder = data_set.session(recording.rows.session, recording.rows.file)
            if folder is not None:
                folder.add(table, row)
                counts |= {table: counts[table] + 1} if table in counts and table != "gaze" else {}
        if folder is not None:
            counts["gaze"] += folder.close(recording.rows.study)
    write_data_set(out, data_set.people.values(), data_set.sessions, version("shift-mesh"))
    return Exported(tuple(sorted(path for path in out.rglob("*") if path.is_file())), counts, sources.report)
