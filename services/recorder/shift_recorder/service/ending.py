"""The end of a session, in two halves.

The first half is committed at once: the session is ``ending`` and takes no commands any more. Then, in the background,
every service reads everything that was published, and the recording is finished. The second half commits the end and
replies to everybody who asked for it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import structlog
from shift_recording.durable_file import StorageFailed
from shift_recording.merging import FinishedRecording
from shift_runtime.journal import Journal
from shift_runtime.service.background import BackgroundTasks
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.requests import PendingRequest
from shift_runtime.service.states import SessionStates
from shift_schemas.errors import DamagedRecording, ShiftError, Unavailable
from shift_schemas.lifecycle import has_ended, is_ending
from shift_schemas.messages import END_ID, EndSession

from shift_recorder import core
from shift_recorder.core import FinishSession, RecorderState
from shift_recorder.service.convergence import Convergence
from shift_recorder.service.segment_sink import SegmentSink
from shift_recorder.service.session_recording import merge_session

log = structlog.get_logger()


Enqueue = Callable[[PendingRequest | Callable[[], None]], None]
"""Passes a request or a function to the worker, after everything that has arrived."""


class SessionEndProtocol:
    """The recorder's end protocol. The recordings of several sessions may be finished at the same time."""

    def __init__(
        self,
        recordings: Path,
        states: SessionStates[RecorderState],
        journal: Journal,
        progress: Progress,
        alarm: DiskAlarm,
        sink: SegmentSink,
        convergence: Convergence,
        tasks: BackgroundTasks,
        enqueue: Enqueue,
    ) -> None:
        self._recordings = recordings
        self._states = states
        self._journal = journal
        self._progress = progress
        self._alarm = alarm
        self._sink = sink
        self._convergence = convergence
        self._tasks = tasks
        self._enqueue = enqueue
        self._waiting: dict[str, list[PendingRequest]] = {}
        """By session, the requests for its end."""
        self._finishing: set[str] = set()
        """Sessions whose second half is under way."""

    # --- the protocol ---

    def takes(self, request: PendingRequest) -> bool:
        """Return whether this is an end of a session that has not ended, by its one command id."""
        message = request.message
        if not isinstance(message, EndSession) or isinstance(message, FinishSession):
            return False
        state = self._states.get(request.session)
        return state is not None and not has_ended(state.fact.state) and message.command_id == END_ID

    def wait(self, request: PendingRequest) -> None:
        """Keep a request for the end until the recording is finished."""
        self._waiting.setdefault(request.session, []).append(request)

    def after_commit(self) -> None:
        """Begin the second half of ends that are committed; requests for ends that are over get their result."""
        for session in list(self._waiting):
            state = self._states.get(session)
            if state is None or has_ended(state.fact.state):
                for request in self._waiting.pop(session):
                    self._enqueue(request)
            elif is_ending(state.fact.state) and session not in self._finishing:
                self._begin(session)

    def resume(self) -> None:
        """Begin the second halves that a crash interrupted."""
        for session, closed in list(self._journal.sessions()):
            state = None if closed else self._states.get(session)
            if state is not None and is_ending(state.fact.state):
                self._begin(session)

    # --- the second half ---

    def _begin(self, session: str) -> None:
        self._finishing.add(session)
        self._tasks.start(self._finish(session))

    async def _finish(self, session: str) -> None:
        try:
            finished = await self._complete_recording(session)
        except Exception as e:
            self._fail(session, e)
            return
        message = FinishSession(
            command_id=END_ID,
            session=session,
            recording=finished.path.name,
            sha256=finished.sha256,
            counts=finished.counts,
        )
        requests = [r for waiting in self._waiting.pop(session, []) for r in waiting.requests]
        self._enqueue(PendingRequest(session, message.procedure, message, requests))
        self._enqueue(lambda: self._finishing.discard(session))
        log.info("recording finished", session=session, file=str(finished.path), messages=sum(finished.counts.values()))

    def _fail(self, session: str, error: Exception) -> None:
        if isinstance(error, StorageFailed):
            self._sink.rewind(session, error)
        if isinstance(error, ShiftError):
            log.warning("the session cannot end yet", session=session, error=error.detail)
        else:
            log.error("the session cannot end", session=session, exc_info=error)
            error = ShiftError(f"the recorder failed to finish {session}: {type(error).__name__}; see its log")
        self._finishing.discard(session)
        for request in self._waiting.pop(session, []):
            request.refuse(error)

    async def _complete_recording(self, session: str) -> FinishedRecording:
        """Return a recording with everything that any service published; read again where a segment was damaged."""
        finished = await self._record_to_the_end(session)
        missing = self._convergence.missing(session, finished.counts)
        if missing:
            log.warning("the recording has holes; reading the journals again", session=session, missing=missing)
            for owner in missing:
                self._progress.restart(session, owner)
            finished = await self._record_to_the_end(session)
            missing = self._convergence.missing(session, finished.counts)
        if missing:
            raise DamagedRecording(f"the recording of {session} lacks messages of the {', the '.join(missing)}")
        return finished

    async def _record_to_the_end(self, session: str) -> FinishedRecording:
        await self._convergence.reach(session)
        state = self._states.get(session)
        assert state is not None
        state = replace(state, fact=core.ended(state))
        self._sink.write(session, state, state.fact, self._journal.heads[session] + 1)
        self._sink.flush()
        if behind := self._convergence.behind(session):
            raise Unavailable(self._alarm.detail or f"the recorder has not written all of the {behind[0]}; ask again")
        return await self._merge(session, state)

    async def _merge(self, session: str, state: RecorderState) -> FinishedRecording:
        def merge() -> FinishedRecording:
            self._sink.finish_segment(session)
            return merge_session(session, state, self._recordings, self._sink.segments)

        return await asyncio.to_thread(merge)

    async def pause(self, session: str) -> None:
        """Make a recording of a session that goes on later, because the process stops."""
        state = self._states.get(session)
        if state is None:
            return
        try:
            await self._merge(session, state)
        except ShiftError as e:
            log.error("the recording is left in segments", session=session, error=e.detail)
            return
        self._sink.remove_segments(session)
