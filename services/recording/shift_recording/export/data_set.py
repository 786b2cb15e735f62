"""Recordings as one BIDS data set: a folder for each participant and session, and the ids that the labels stand for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from shift_schemas.messages import Session

from shift_recording.export.arrow_tables import gaze_reader
from shift_recording.export.bids import BidsSession, Labels, write_data_set
from shift_recording.export.screen import Screen
from shift_recording.export.sources import OnProgress, Sources, covariates_of
from shift_recording.export.tables import Row, table_columns


class DataSet:
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


def export_data_set(
    sources: Sources, out: Path, screen: Screen, on_progress: OnProgress | None
) -> tuple[tuple[Path, ...], dict[str, int]]:
    """Write recordings as a BIDS data set. Return its files, and how many rows of each table it has."""
    reader = gaze_reader(table_columns(sources.names)["gaze"], as_text=False)
    data_set = DataSet(out, screen, sources.covariates)
    counts = dict.fromkeys(("sessions", "gaze", "fixations", "decisions", "performances", "markers"), 0)
    for recording in sources.recordings(on_progress):
        folder: BidsSession | None = None
        for table, row in recording.rows_of(reader):
            if folder is None and recording.rows.session is not None:
                folder = data_set.session(recording.rows.session, recording.rows.file)
            if folder is None:
                continue
            if isinstance(row, dict):
                folder.add(table, row)
                counts |= {table: counts[table] + 1} if table in counts else {}
            else:
                folder.add_gaze(row)
        if folder is not None:
            counts["gaze"] += folder.close(recording.rows.study)
    write_data_set(out, data_set.people.values(), data_set.sessions, version("shift-mesh"))
    return tuple(sorted(path for path in out.rglob("*") if path.is_file())), counts
