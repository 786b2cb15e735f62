"""The recordings of an export: found in folders, read one after the other, and reported if they are damaged."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shift_schemas.errors import DamagedRecording, MalformedMessage, UnknownThing
from shift_schemas.messages import Aois, Config, Fact, Gaze, Session
from shift_study.loading import study_from_json

from shift_recording.exclusion import read_exclusion
from shift_recording.export.columns import Names
from shift_recording.export.tables import RecordingRows, Row, names_in
from shift_recording.files import recordings_in
from shift_recording.mcap.index import facts_about
from shift_recording.mcap.reader import RecordedMessage, Recording, recorded_fact

if TYPE_CHECKING:
    import pyarrow as pa

    from shift_recording.export.gaze_samples import GazeReader
    from shift_recording.export.hits import HitFinder

OnProgress = Callable[[int, int], None]
"""Called with the number of bytes that were read, and their total."""


@dataclass
class Report:
    """What an export read and left out."""

    read: list[str] = field(default_factory=list)
    excluded: dict[str, str] = field(default_factory=dict)
    """Recordings that are excluded from analysis, and why."""
    damaged: dict[str, str] = field(default_factory=dict)
    """Recordings that could not be read, or not completely, and why."""

    def raise_damage(self) -> None:
        """Raise :class:`DamagedRecording` for the first damaged recording."""
        for name, why in self.damaged.items():
            raise DamagedRecording(f"{name}: {why}")


HELD_BYTES = 2**20
"""Gaze is read when so many bytes of it are held: about 20,000 samples."""


HELD_MOVES = 500
"""As many messages of moving AOIs may come before gaze is read; fewer than a track of them keeps."""


class OneRecording:
    """The rows of one recording. Read it once."""

    def __init__(self, path: Path, report: Report, covariates: Mapping[str, Mapping[str, str]]) -> None:
        self.rows = RecordingRows(path.name)
        self._path, self._report, self._covariates = path, report, covariates
        self._hits: HitFinder | None = None
        self._moves = 0
        """Messages of moving AOIs since gaze was read last."""

    def rows_of(self, gaze: GazeReader | None) -> Iterator[tuple[str, Row | pa.Table]]:
        """Yield the rows, each with its table; gaze comes as tables of pyarrow, and not at all without a reader.

        A damaged file is reported and gives the rows before the damage.
        """
        name, recording = self._path.name, Recording(self._path)
        held: list[RecordedMessage] = []
        size = 0
        try:
            self.rows.session = first_session(self._path)
            for message in recording.messages():
                if message.topic != Gaze.subject:
                    recorded = recorded_fact(self._path, message)
                    if gaze is not None and self._must_be_read_before(recorded.fact) and held:
                        reading, held, size = held, [], 0
                        yield from self._samples(gaze, reading)
                    self._take(recorded.fact)
                    yield from self.rows.rows(recorded)
                elif gaze is not None:
                    held.append(message)
                    size += len(message.data)
                    if size >= HELD_BYTES:
                        reading, held, size = held, [], 0
                        yield from self._samples(gaze, reading)
        except (DamagedRecording, MalformedMessage) as e:
            self._report.damaged[name] = e.detail
        try:
            if gaze is not None and held:
                yield from self._samples(gaze, held)
        except DamagedRecording as e:
            self._report.damaged[name] = e.detail
        whole = recording.report.complete and name not in self._report.damaged
        reason = "" if whole else self._report.damaged.get(name, recording.report.reason)
        yield from self.rows.rest(whole, reason, covariates_of(self.rows.session, self._covariates))

    def _must_be_read_before(self, fact: Fact) -> bool:
        """Return whether the gaze that is held must be read before a fact, which changes where the AOIs were."""
        if not isinstance(fact, Aois) or self._hits is None:
            return False
        return self._moves >= HELD_MOVES or self._hits.begins_anew(fact)

    def _take(self, fact: Fact) -> None:
        """Take what gaze is tested against."""
        if isinstance(fact, Config) and self._hits is None:
            from shift_recording.export.hits import HitFinder

            self._hits = HitFinder(study_from_json(fact.study))
        elif isinstance(fact, Aois) and self._hits is not None:
            self._hits.move(fact)
            self._moves += 1

    def _samples(self, gaze: GazeReader, messages: list[RecordedMessage]) -> Iterator[tuple[str, pa.Table]]:
        self._moves = 0
        samples = gaze.read(self.rows.session, messages, self._hits)
        yield "gaze", samples.rows
        if samples.damage is not None:
            raise DamagedRecording(f"{self._path.name}: {samples.damage.detail}")


@dataclass(frozen=True)
class Sources:
    """The recordings to export, the names in them, and the covariates of their participants."""

    files: tuple[Path, ...]
    names: Names
    covariates: Mapping[str, Mapping[str, str]]
    report: Report

    @property
    def covariate_names(self) -> tuple[str, ...]:
        """The names of the covariates: those of the sessions, then those of the file."""
        named = (name for given in self.covariates.values() for name in given)
        return tuple(dict.fromkeys((*self.names.covariates, *named)))

    def recordings(self, on_progress: OnProgress | None = None) -> Iterator[OneRecording]:
        """Yield the recordings one after the other."""
        total = sum(path.stat().st_size for path in self.files)
        done = 0
        for path in self.files:
            yield OneRecording(path, self.report, self.covariates)
            done += path.stat().st_size
            if on_progress is not None:
                on_progress(done, total)


def first_session(path: Path) -> Session | None:
    """Return the session of a recording as it began; other messages can stand before it in the file."""
    for recorded in Recording(path).facts(("session",)):
        assert isinstance(recorded.fact, Session)
        return recorded.fact
    return None


def covariates_of(session: Session | None, given: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Return the covariates of a session: those of its start, in whose place those of the file stand."""
    if session is None:
        return {}
    return {**session.covariates, **given.get(session.participant, {})}


def read_covariates(path: Path | None) -> dict[str, dict[str, str]]:
    """Return the covariates by participant. The file is a CSV with a column ``participant``.

    Raises
    ------
    UnknownThing
        The file cannot be read.
    MalformedMessage
        It has no column ``participant``, or names a participant twice.
    """
    if path is None:
        return {}
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError) as e:
        raise UnknownThing(f"the covariates {path} cannot be read as UTF-8: {e}") from e
    found: dict[str, dict[str, str]] = {}
    for line, row in enumerate(rows, 2):
        participant = row.pop("participant", None)
        if participant is None:
            raise MalformedMessage(f"{path}: the first line must name the columns, and one of them is participant")
        if participant in found:
            raise MalformedMessage(f"{path}, line {line}: participant {participant!r} is there twice")
        found[participant] = {name: value for name, value in row.items() if name is not None}
    return found


def _check_session(path: Path, known: dict[str, str], names: Names) -> None:
    """Note the names of the covariates. Raise :class:`MalformedMessage` if another file has the same session."""
    session = first_session(path)
    names.covariates |= dict.fromkeys(session.covariates if session is not None else ())
    if session is not None and (other := known.setdefault(session.session, str(path))) != str(path):
        raise MalformedMessage(
            f"{other} and {path} are both recordings of session {session.session}, so their rows could not be told "
            "apart; export them into different folders"
        )


def open_sources(paths: Iterable[Path], covariates: Path | None, with_excluded: bool) -> Sources:
    """Find the recordings and read the names in them.

    Raises
    ------
    UnknownThing, MalformedMessage
        As :func:`~shift_recording.files.recordings_in` and :func:`read_covariates`, or two recordings are of the same
        session.
    """
    report, names, files = Report(), Names(), list[Path]()
    session_files: dict[str, str] = {}
    for path in recordings_in(paths):
        excluded: Any = None
        try:
            excluded = read_exclusion(path).in_force
            if excluded is None or with_excluded:
                _check_session(path, session_files, names)
                names_in((recorded.fact for recorded in facts_about(path, ("config", "decision"))), names)
        except DamagedRecording as e:
            report.damaged[path.name] = e.detail
        if excluded is not None and not with_excluded:
            report.excluded[path.name] = excluded.reason
            continue
        files.append(path)
        report.read.append(path.name)
    return Sources(tuple(files), names, read_covariates(covariates), report)
