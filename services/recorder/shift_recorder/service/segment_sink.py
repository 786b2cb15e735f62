"""The recorder's sink: facts of every owner are written to segments, and count as read once they are on the disk."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import structlog
from shift_recording.durable_file import StorageFailed
from shift_recording.mcap.schemas import recorded_json, subject_schemas
from shift_recording.segments import SegmentWriter
from shift_runtime.clock import Clock
from shift_runtime.journal import Batch, Journal
from shift_runtime.metrics import Metrics
from shift_runtime.reader import SESSION_OWNER, Reader, ReadFact
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.states import SessionStates
from shift_schemas.errors import Unavailable
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Fact, Session
from shift_study.loading import study_from_json

from shift_recorder.core import RecorderState

log = structlog.get_logger()

FLUSH_EVERY_S = 1.0


@lru_cache(maxsize=64)
def _schemas_of(study: str) -> dict[str, bytes]:
    """Return the recording's schemas for a study as ``config`` has it; most sessions have the same study."""
    return subject_schemas(study_from_json(study))


class SegmentSink:
    """Writes facts to one segment file a session, and goes back to what is safe where the disk refuses.

    After a crash the facts that were not flushed are read again; what is then written twice is dropped when the
    segments are merged.

    Parameters
    ----------
    close_session
        Closes a session in the open transaction.
    """

    def __init__(
        self,
        segments: Path,
        states: SessionStates[RecorderState],
        reader: Reader,
        progress: Progress,
        journal: Journal,
        alarm: DiskAlarm,
        clock: Clock,
        metrics: Metrics,
        close_session: Callable[[str], None],
    ) -> None:
        self.segments = segments
        self._states = states
        self._reader = reader
        self._progress = progress
        self._journal = journal
        self._alarm = alarm
        self._clock = clock
        self._metrics = metrics
        self._close_session = close_session
        self._writers: dict[str, SegmentWriter] = {}
        self._unflushed: dict[tuple[str, str], int] = {}

    @property
    def sessions(self) -> list[str]:
        """The sessions with an open segment."""
        return list(self._writers)

    def apply(self, read: ReadFact) -> None:
        """Write a fact to its session's segment."""
        if not self._progress.is_next(read):
            return
        session, key = read.fact.session, (read.fact.session, read.owner)
        state = self._states.get(session)
        if state is None:
            self._metrics.dropped("refused")
            self._reader.cursors.pop(key, None)
            return
        if has_ended(state.fact.state):
            self._pass_over(read)
            return
        try:
            self.write(session, state, read.fact, read.seq)
        except StorageFailed as e:
            self.rewind(session, e)
            return
        self._progress.mark(read)
        self._unflushed[key] = read.seq
        self._metrics.read(read.fact.subject)

    def _pass_over(self, read: ReadFact) -> None:
        """Close the session once its own end was read; its recording is finished already."""
        session = read.fact.session
        is_end = read.owner == SESSION_OWNER and isinstance(read.fact, Session)
        if is_end and read.seq == self._journal.heads[session]:
            self._close_session(session)
            self.remove_segments(session)
        self._progress.mark(read)

    def write(self, session: str, state: RecorderState, fact: Fact, sequence: int) -> None:
        """Append a fact to the session's segment. Raises :class:`StorageFailed`."""
        if session not in self._writers:
            self._writers[session] = SegmentWriter(self.segments, session, _schemas_of(state.config.study))
        now = self._clock.now().ns
        self._writers[session].write(fact.subject, sequence, now, fact.stamp.ns, recorded_json(fact))

    def start_flushing(self, schedule: Callable[[Callable[[], None]], None]) -> None:
        """Flush every :data:`FLUSH_EVERY_S`, in the worker's turn."""

        def tick() -> None:
            schedule(self.flush)
            loop.call_later(FLUSH_EVERY_S, tick)

        loop = asyncio.get_running_loop()
        loop.call_later(FLUSH_EVERY_S, tick)

    def flush(self) -> None:
        """Write everything to the disk, and then commit that it was read."""
        for session in {s for s, _ in self._unflushed}:
            written = {key: n for key, n in self._unflushed.items() if key[0] == session}
            try:
                if session in self._writers:
                    self._writers[session].flush()
                self._journal.commit(Batch(cursors=dict(written)))
            except Unavailable as e:
                self.rewind(session, e)
                continue
            self._alarm.clear_alarm()
            for key in written:
                self._unflushed.pop(key, None)

    def rewind(self, session: str, error: Unavailable) -> None:
        """Go back to what is committed of a session whose facts the disk refused; the rest is read again later."""
        if not self._alarm.detail:
            log.error("the recording cannot be written", session=session, error=error.detail)
        self._alarm.raise_alarm(error)
        self._metrics.commit_failed()
        writer = self._writers.pop(session, None)
        if writer is not None:
            writer.abandon()
        inputs = [(session, owner) for owner in self._reader.owners]
        for key in inputs:
            self._unflushed.pop(key, None)
        self._progress.rewind(inputs)

    def finish_segment(self, session: str) -> None:
        """Close the session's segment, so that it can be merged. It may run in a thread."""
        writer = self._writers.pop(session, None)
        if writer is not None:
            writer.finish()

    def remove_segments(self, session: str) -> None:
        """Remove the session's segments, which are merged into its recording."""
        for owner in self._reader.owners:
            self._reader.pages.pop(f"{owner}/{session}", None)
        shutil.rmtree(self.segments / session, ignore_errors=True)
