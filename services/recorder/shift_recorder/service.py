"""The recorder's shell: what a worker does, and the MCAP files.

It reads every owner, itself included. What it has written counts as read only once it is flushed to
the disk, so that after a crash it reads again from there; what is then there twice is dropped when the
segments are merged. A session ends when every service has read the end and all that the others put out
before it; then the recording is finished and the end acknowledged.
"""

from __future__ import annotations

import asyncio
import json
import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import structlog
from shift_recording.durable_file import StorageFailed
from shift_recording.mcap.reader import Recording
from shift_recording.mcap.records import Attachment
from shift_recording.mcap.schemas import recorded_json, subject_schemas
from shift_recording.merging import FinishedRecording, finish_recording
from shift_recording.provenance import attachments_of, metadata_of
from shift_recording.segments import SegmentWriter, segments_of
from shift_runtime.bus.protocol import Incoming
from shift_runtime.journal import Batch
from shift_runtime.reader import ReadFact
from shift_runtime.service.loop import Asked, Core, Worker, _Turn
from shift_runtime.settings import MeshSettings
from shift_runtime.study_files import study_to_start
from shift_schemas.errors import Conflict, DamagedRecording, MalformedMessage, ShiftError, Unavailable
from shift_schemas.keys import OWNERS, READS, ROOT, FactKey, StreamKey, parse_key
from shift_schemas.lifecycle import has_ended, is_ending
from shift_schemas.messages import END_ID, Command, EndSession, Fact, GazeChunk, OutboxPage, StartSession
from shift_study.loading import study_from_json

from shift_recorder import core
from shift_recorder.core import FinishSession, RecorderState

log = structlog.get_logger()

FLUSH_EVERY_S = 1.0
END_WAIT_S = 3.5
"""How long an end waits for the other services; below the doors' patience, so that they hear why."""
LEAST_FREE_BYTES = 64 * 2**20
"""No session starts with less room than this on the disk; chosen: an hour of 300 Hz gaze and its journals."""
_PEERS = ("monitor", "decider", "learner")

CORE: Core[RecorderState] = Core(
    name="recorder",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["recorder"],
)


@lru_cache(maxsize=1)
def software() -> tuple[str, str]:
    """Version of shift-mesh and git revision, where known (``SHIFT_REVISION``)."""
    try:
        return version("shift-mesh"), os.environ.get("SHIFT_REVISION", "")
    except PackageNotFoundError:
        return "0", os.environ.get("SHIFT_REVISION", "")


class RecorderWorker(Worker[RecorderState]):
    """See the module."""

    def __init__(self, *given: Any, settings: MeshSettings) -> None:
        super().__init__(*given)
        self.recordings = settings.data / "recordings"
        self.segments = settings.data / "segments"
        self.studies = settings.data / "studies"
        self._writers: dict[str, SegmentWriter] = {}
        self._unflushed: dict[tuple[str, str], int] = {}
        self._ends: dict[str, list[Asked]] = {}
        """Who waits for a session's end."""
        self._ending: set[str] = set()
        """Sessions whose recording is being finished; one at a time."""

    # --- life ---

    async def on_start(self) -> None:
        """Go on with ends that a crash interrupted, and flush from time to time."""
        self.bus.subscribe(f"{ROOT}/**", self._stray)
        self.bus.subscribe(f"{ROOT}/@service/**", self._stray)  # a star takes in no part that begins with @
        for session, closed in list(self.journal.sessions()):
            state = None if closed else self._state(session)
            if state is not None and is_ending(state.fact.state):
                self._begin_end(session)
        self._later()

    def _stray(self, incoming: Incoming) -> None:
        """What is published where nobody listens is counted here: no key of the mesh, a command, a service's door."""
        try:
            key = parse_key(incoming.key)
        except MalformedMessage:
            key = None
        if not isinstance(key, FactKey | StreamKey):
            self.metrics.dropped("malformed")

    def _later(self) -> None:
        asyncio.get_running_loop().call_later(FLUSH_EVERY_S, self._tick)

    def _tick(self) -> None:
        self.enqueue(self._flush)
        self._later()

    async def on_stop(self) -> None:
        """Read what is left, and finish the files of the sessions that go on later."""
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=2 * END_WAIT_S)
        await self.reader.pull_all(self.reader.owners)
        while self._queue:
            await self._turn()
        self._flush()
        for session in list(self._writers):
            await self._pause(session)

    # --- commands ---

    def prepare(self, session: str, message: Command | GazeChunk) -> Any:
        """A start gets its study, and is refused where there is no room for its recording."""
        if not isinstance(message, StartSession):
            return message
        self._check_room()
        study, warnings = study_to_start(message.study, self.studies)
        known, revision = software()
        found = {"study": study, "software": known, "revision": revision, "warnings": list(warnings)}
        return message.model_copy(update=found)

    def _check_room(self) -> None:
        try:
            self.segments.mkdir(parents=True, exist_ok=True)
            self.recordings.mkdir(parents=True, exist_ok=True)
            free = shutil.disk_usage(self.recordings).free
        except OSError as e:
            raise Unavailable(f"the recorder cannot write to {self.recordings}: {e.strerror}") from e
        if not os.access(self.segments, os.W_OK) or not os.access(self.recordings, os.W_OK):
            raise Unavailable(f"the recorder must not write to {self.recordings}: the folder is read-only")
        if free < LEAST_FREE_BYTES:
            raise Unavailable(f"{self.recordings} has {free // 2**20} MB left; no session starts below 64 MB")

    def _answer(self, turn: _Turn, asked: Asked) -> None:
        if not isinstance(asked.message, EndSession) or isinstance(asked.message, FinishSession):
            super()._answer(turn, asked)
            return
        state = self._state(asked.session)
        if state is None or has_ended(state.fact.state) or asked.message.command_id != END_ID:
            super()._answer(turn, asked)
            return
        self._take(turn, asked.session, self.core.step(state, asked.message, self.clock.now()))
        self._ends.setdefault(asked.session, []).append(asked)

    def after_turn(self) -> None:
        """Begin the ends that are committed now; who asked for one that is over gets its result."""
        for session in list(self._ends):
            state = self._state(session)
            if state is None or has_ended(state.fact.state):
                for asked in self._ends.pop(session):
                    self.enqueue(asked)
            elif is_ending(state.fact.state) and session not in self._ending:
                self._begin_end(session)

    # --- recording ---

    def _apply(self, turn: _Turn, read: ReadFact) -> None:
        session, key = read.fact.session, (read.fact.session, read.owner)
        if read.seq != self.processed.get(key, 0) + 1:
            return
        state = self._state(session)
        if state is None:
            self.metrics.dropped("refused")
            self.reader.cursors.pop(key, None)
            return
        if has_ended(state.fact.state):
            if read.owner == "recorder" and read.fact.subject == "session" and read.seq == self.journal.heads[session]:
                turn.ended.add(session)
                self._tidy(session)
            self.processed[key] = read.seq
            return
        try:
            self._write(session, state, read.fact, read.seq)
        except StorageFailed as e:
            self._rewind(session, e)
            return
        self.processed[key] = self._unflushed[key] = read.seq
        self.metrics.read(read.fact.subject)

    def _write(self, session: str, state: RecorderState, fact: Fact, sequence: int) -> None:
        if session not in self._writers:
            schemas = subject_schemas(study_from_json(state.config.study))
            self._writers[session] = SegmentWriter(self.segments, session, schemas)
        now = self.clock.now().ns
        self._writers[session].write(fact.subject, sequence, now, fact.stamp.ns, recorded_json(fact))

    def _flush(self) -> None:
        """Put what was written on the disk, and then count it as read."""
        for session in {s for s, _ in self._unflushed}:
            mine = {key: n for key, n in self._unflushed.items() if key[0] == session}
            try:
                if session in self._writers:
                    self._writers[session].flush()
                self.journal.commit(Batch(cursors=dict(mine)))
            except Unavailable as e:
                self._rewind(session, e)
                continue
            self._relieved()
            for key in mine:
                self._unflushed.pop(key, None)

    def _rewind(self, session: str, error: Unavailable) -> None:
        """The disk refused: go back to what is safe, and read the rest again later."""
        if not self._alarm:
            log.error("the recording cannot be written", session=session, error=error.detail)
        self._alarm = error.detail
        self._check_later()  # there may be nothing left to write that would notice when there is room again
        self.metrics.commit_failed()
        writer = self._writers.pop(session, None)
        if writer is not None:
            writer.abandon()
        committed = self.journal.cursors()
        for owner in self.reader.owners:
            self._unflushed.pop((session, owner), None)
            self.reader.cursors[session, owner] = self.processed[session, owner] = committed.get((session, owner), 0)

    # --- ending ---

    def _begin_end(self, session: str) -> None:
        self._ending.add(session)
        self._background(self._end(session))

    async def _end(self, session: str) -> None:
        try:
            finished = await self._whole(session)
        except Exception as e:
            self._end_failed(session, e)
            return
        requests = [r for asked in self._ends.pop(session, []) for r in asked.requests]
        message = FinishSession(
            command_id=END_ID,
            session=session,
            recording=finished.path.name,
            sha256=finished.sha256,
            counts=finished.counts,
        )
        self.enqueue(Asked(session, "end_session", message, requests))
        self.enqueue(lambda: self._ending.discard(session))
        log.info("recording finished", session=session, file=str(finished.path), messages=sum(finished.counts.values()))

    def _end_failed(self, session: str, error: Exception) -> None:
        if isinstance(error, StorageFailed):
            self._rewind(session, error)
        if isinstance(error, ShiftError):
            log.warning("the session cannot end yet", session=session, error=error.detail)
        else:
            log.error("the session cannot end", session=session, exc_info=error)
            error = ShiftError(f"the recorder failed to finish {session}: {type(error).__name__}; see its log")
        self._ending.discard(session)
        for asked in self._ends.pop(session, []):
            asked.refuse(error)

    async def _whole(self, session: str) -> FinishedRecording:
        """The session's recording with all in it that any service put out; read again where a segment was damaged."""
        finished = await self._recorded_to_the_end(session)
        missing = self._missing(session, finished)
        if missing:
            log.warning("the recording has holes; reading the journals again", session=session, missing=missing)
            for owner in missing:
                self.reader.cursors[session, owner] = self.processed[session, owner] = 0
            finished = await self._recorded_to_the_end(session)
            missing = self._missing(session, finished)
        if missing:
            raise DamagedRecording(f"the recording of {session} lacks messages of the {', the '.join(missing)}")
        return finished

    async def _recorded_to_the_end(self, session: str) -> FinishedRecording:
        await self._converge(session)
        state = self._state(session)
        assert state is not None
        state = replace(state, fact=core.ended(state))
        self._write(session, state, state.fact, self.journal.heads[session] + 1)
        self._flush()
        if behind := self._behind(session):
            raise Unavailable(self._alarm or f"the recorder has not written all of the {behind[0]}; ask again")
        return await asyncio.to_thread(self._finished, session, state)

    def _missing(self, session: str, finished: FinishedRecording) -> tuple[str, ...]:
        """Owners of whom the recording lacks something, in its middle or at its end."""
        heads = {owner: self.reader.pages[f"{owner}/{session}"].heads[session] for owner in OWNERS}
        heads["recorder"] += 1  # the end, of which the recording has a version of its own
        there = {owner: sum(finished.counts.get(subject, 0) for subject in OWNERS[owner]) for owner in OWNERS}
        return tuple(owner for owner in OWNERS if there[owner] != heads[owner])

    async def _converge(self, session: str) -> None:
        """Read until every service has read the end and all that came before it."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + END_WAIT_S
        while True:
            silent = await self.reader.pull_all(("recorder", *_PEERS), session)
            behind = silent or self._behind(session)
            misfit = "" if silent else self._misfit(session)
            if not behind and not misfit:
                return
            if loop.time() > deadline:
                if misfit:
                    raise Conflict(misfit)
                why = "does not answer" if silent else "has not caught up"
                raise Unavailable(f"session {session} cannot end yet: the {behind[0]} {why}; ask again")
            await asyncio.sleep(0.02)

    def _misfit(self, session: str) -> str:
        """Return a sentence where a service has read more of another one than there is: a folder that was copied."""
        pages = {owner: self.reader.pages[f"{owner}/{session}"] for owner in ("recorder", *_PEERS)}
        for peer in _PEERS:
            for owner, read in pages[peer].cursors.get(session, {}).items():
                head = pages[owner].heads.get(session, 0)
                if read > head:
                    return (
                        f"session {session} cannot end: the {peer} has read {read} messages of the {owner}, whose "
                        f"journal ends at {head}: the data folder was copied while a mesh used it; end the session on "
                        "the original"
                    )
        return ""

    def _behind(self, session: str) -> tuple[str, ...]:
        pages = {owner: self.reader.pages[f"{owner}/{session}"] for owner in ("recorder", *_PEERS)}
        own = {owner: self.processed.get((session, owner), 0) for owner in pages}
        late = [owner for owner, page in pages.items() if own[owner] < page.heads.get(session, 0)]
        return tuple(late) or tuple(p for p in _PEERS if _has_not_read(p, pages, session))

    def _finished(self, session: str, state: RecorderState) -> FinishedRecording:
        """Merge all there is of the session into its recording; in a thread, it takes its time."""
        writer = self._writers.pop(session, None)
        if writer is not None:
            writer.finish()
        target = self.recordings / f"{session}.mcap"
        sources = [p for p in (target,) if p.exists()] + segments_of(self.segments, session)
        policies = _first_and_last_policy(sources)
        return finish_recording(
            session,
            sources,
            target,
            schemas=subject_schemas(study_from_json(state.config.study), _states_of(policies)),
            metadata=metadata_of(state.fact, state.config),
            attachments=[
                Attachment(name, "application/json", data, state.fact.started.ns)
                for name, data in attachments_of(state.config, state.original, policies).items()
            ],
        )

    async def _pause(self, session: str) -> None:
        """The process stops and the session lives on: leave a whole file of it so far."""
        state = self._state(session)
        if state is None:
            return
        try:
            await asyncio.to_thread(self._finished, session, state)
        except ShiftError as e:
            log.error("the recording is left in segments", session=session, error=e.detail)
            return
        self._tidy(session)

    def _tidy(self, session: str) -> None:
        """Remove the segments that were merged."""
        for owner in self.reader.owners:
            self.reader.pages.pop(f"{owner}/{session}", None)
        folder: Path = self.segments / session
        shutil.rmtree(folder, ignore_errors=True)


def _has_not_read(peer: str, pages: dict[str, OutboxPage], session: str) -> bool:
    cursors = pages[peer].cursors.get(session, {})
    return any(cursors.get(owner, 0) < pages[owner].heads.get(session, 0) for owner in READS[peer])


def _first_and_last_policy(sources: Iterable[Path]) -> tuple[bytes, bytes] | None:
    """By the learner's numbers: what a cut segment lost stands in a later one."""
    first: tuple[int, bytes] | None = None
    last: tuple[int, bytes] | None = None
    for source in sources:
        with suppress(DamagedRecording):
            for message in Recording(source).messages({"policy"}):
                if first is None or message.sequence < first[0]:
                    first = (message.sequence, message.data)
                if last is None or message.sequence > last[0]:
                    last = (message.sequence, message.data)
    return (first[1], last[1]) if first is not None and last is not None else None


def _states_of(policies: tuple[bytes, bytes] | None) -> tuple[str, ...]:
    return tuple(json.loads(policies[0])["states"]) if policies else ()
