"""The door: what the REST paths do, without HTTP. It remembers what it answered.

Each method takes what a request says and gives what is said back; errors are the error tree's.
"""

from __future__ import annotations

import json
import secrets
from functools import partial
from typing import Any

from shift_decider.core import ANY_TASK, decided
from shift_runtime.clock import Clock
from shift_runtime.mesh_client import MeshClient
from shift_schemas.errors import Unavailable, UnknownThing
from shift_schemas.messages import (
    Answer,
    Command,
    Configure,
    Decide,
    EndSession,
    GazeChunk,
    Mark,
    Observation,
    ReportPerformance,
    Seen,
    Session,
    SetOverride,
    StartSession,
)
from shift_schemas.step import NotYet, covers, merged_seen

from shift_gateway.bodies import DecisionBody, MarkerBody, OverrideBody, PerformanceBody, StartBody
from shift_gateway.replica import Replica, View

READ_WAIT_S = 2.0
"""How long a read waits for what it must have in it, at least; a study's ``wait_s`` can make it longer."""
START_ID, END_ID = "start", "end"
PREVIEW_ID = "preview"


def new_id(prefix: str) -> str:
    """An id that nobody else has."""
    return f"{prefix}{secrets.token_hex(8)}"


class Door:
    """See the module."""

    def __init__(self, mesh: MeshClient, replica: Replica, clock: Clock) -> None:
        self.mesh = mesh
        self.replica = replica
        self.clock = clock

    # --- commands ---

    async def start(self, body: StartBody) -> tuple[dict[str, Any], bool]:
        """Begin a session; the answer, and whether it is a repeat's."""
        session = body.session or new_id("s-")
        command = StartSession(
            command_id=START_ID, session=session, participant=body.participant, study=body.study,
            seed=body.seed, condition=body.condition,
        )  # fmt: skip
        answer = await self.mesh.command(command)
        await self.replica.view(session)
        self._remember(session, answer, Seen(config=1))
        return answer.result, answer.repeat

    async def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        """Hand gaze to the monitor; acknowledged once it is in the journal."""
        await self.replica.view(session)
        answer = await self.mesh.gaze(session, chunk)
        self._remember(session, answer, Seen(gaze={chunk.source: chunk.seq}))
        return {"accepted": answer.result["accepted"]}

    async def decide(self, session: str, body: DecisionBody) -> tuple[dict[str, Any], bool]:
        """The next decision."""
        view = await self.replica.view(session)
        command_id = body.decision_id or new_id("d-")
        command = Decide(command_id=command_id, session=session, task=body.task, need=view.need)
        answer = await self.mesh.command(command, wait_s=await self._wait_s(view))
        self._remember(session, answer, Seen(decision=answer.result["n"]))
        return answer.result, answer.repeat

    async def report(self, session: str, body: PerformanceBody) -> tuple[dict[str, Any], bool]:
        """How the task went."""
        view = await self.replica.view(session)
        if view.fact.state != "ended":
            await self._check_decision(session, view, body.decision_id)
        command = ReportPerformance(
            command_id=body.decision_id, session=session, need=view.need,
            comprehension=body.comprehension, enabledness=body.enabledness,
        )  # fmt: skip
        answer = await self.mesh.command(command, wait_s=READ_WAIT_S)
        self._remember(session, answer, Seen(performance=answer.result["n"]))
        result = dict(answer.result)
        for dimension in ("comprehension", "enabledness"):
            result[dimension] = result[dimension]["value"]
        return result, answer.repeat

    async def override(self, session: str, body: OverrideBody) -> tuple[dict[str, Any], bool]:
        """Choose the task's next strategy."""
        view = await self.replica.view(session)
        command = SetOverride(
            command_id=body.override_id or new_id("o-"), session=session, need=view.need,
            task=body.task, strategy=body.strategy, reason=body.reason,
        )  # fmt: skip
        return await self._plain(session, command, await self._wait_s(view))

    async def mark(self, session: str, body: MarkerBody) -> tuple[dict[str, Any], bool]:
        """Note something."""
        await self.replica.view(session)
        return await self._plain(
            session, Mark(command_id=body.marker_id or new_id("m-"), session=session, text=body.text)
        )

    async def configure(self, session: str, patch: dict[str, Any]) -> dict[str, Any]:
        """Change the study in force."""
        await self.replica.view(session)
        answer = await self.mesh.command(Configure(command_id=new_id("c-"), session=session, patch=patch))
        self._remember(session, answer, Seen(config=answer.result["version"]))
        return answer.result

    async def end(self, session: str) -> dict[str, Any]:
        """End the session; answered once its recording is finished."""
        await self.replica.view(session)
        answer = await self.mesh.command(EndSession(command_id=END_ID, session=session), wait_s=10.0)
        self._remember(session, answer, Seen())
        return answer.result

    async def _plain(self, session: str, command: Command, wait_s: float = 0.0) -> tuple[dict[str, Any], bool]:
        answer = await self.mesh.command(command, wait_s)
        self._remember(session, answer, Seen())
        return answer.result, answer.repeat

    def _remember(self, session: str, answer: Answer, seen: Seen) -> None:
        view = self.replica.views.get(session)
        if view is not None:
            view.answered = merged_seen(view.answered, seen)
            view.sequences[answer.owner] = max(view.sequences.get(answer.owner, 0), answer.seq)

    async def _wait_s(self, view: View) -> float:
        await self._read(view, ("recorder",))
        return view.study.decider.wait_s

    async def _check_decision(self, session: str, view: View, decision_id: str) -> None:
        if decision_id not in view.decisions:
            if not await self.replica.reader.pull("decider"):
                raise Unavailable("the decider does not answer, so nobody knows whether there is such a decision")
            if decision_id not in view.decisions:
                raise UnknownThing(f"session {session} has no decision {decision_id}")

    # --- reads ---

    async def session(self, session: str) -> dict[str, Any]:
        """The session, with counts so far."""
        view = await self.replica.view(session)
        if view.fact.state != "ended":
            await self._read(view, tuple(view.sequences))
        return session_body(view)

    async def sessions(self) -> list[dict[str, Any]]:
        """Every session."""
        if not await self.replica.reader.pull("recorder") and "recorder" in self.replica.missing:
            raise Unavailable("the recorder does not answer, so nobody knows which sessions there are")
        return [session_body(view) for view in self.replica.views.values()]

    async def observation(self, session: str) -> dict[str, Any]:
        """The partner model, with all in it that was answered before."""
        view = await self._current(session, "monitor")
        need = view.need.model_copy(update={"observation": 0, "policy": 0})
        found = await self._newest(view, "monitor", lambda: view.observation if _has(view.observation, need) else None)
        assert isinstance(found, Observation)
        data: dict[str, Any] = found.model_dump(mode="json")
        data["gaze"]["aoi"] = data["gaze"]["aoi"] or None
        return data

    async def policy(self, session: str) -> dict[str, Any]:
        """The policy for the next decision."""
        view = await self._current(session, "learner")
        need = view.need.model_copy(update={"gaze": {}, "observation": 0, "policy": 0})
        found = await self._newest(view, "learner", lambda: view.policy if _has(view.policy, need) else None)
        data: dict[str, Any] = found.model_dump(mode="json")
        return data

    async def config(self, session: str) -> dict[str, Any]:
        """The study in force, with its version."""
        view = await self.replica.view(session)
        await self._read(view, ("recorder",))
        if view.config is None:
            raise Unavailable("the recorder has put out no configuration of this session yet")
        return {**json.loads(view.config.study), "version": view.config.version}

    async def preview(self, session: str, task: str) -> dict[str, Any]:
        """What a decision made now would carry; the decider's own core on the replica, no side effect."""
        view = await self._current(session, "decider")
        wait_s = await self._wait_s(view)
        await self._read(view, ("decider",))

        def attempt(late: bool) -> dict[str, Any] | None:
            try:
                found = decided(view.decider_state(), task, PREVIEW_ID, view.need, self.clock.now(), late)
            except NotYet:
                return None
            return found.model_dump(mode="json", exclude={"decision_id"})

        assert task != ANY_TASK
        came = await self.replica.wait(
            session, ("recorder", "monitor", "learner"), lambda: attempt(False) is not None, wait_s
        )
        result = attempt(late=not came)
        assert result is not None
        return result

    async def _current(self, session: str, owner: str) -> View:
        """The session's view; of one that ended before this gateway began, the journal is read now."""
        view = await self.replica.view(session)
        if view.fact.state == "ended" and (session, owner) not in self.replica.reader.cursors:
            silent = await self.replica.reader.pull_all(("monitor", "decider", "learner"), session)
            if silent:
                raise Unavailable(f"the {silent[0]} does not answer")
        return view

    async def _read(self, view: View, owners: tuple[str, ...]) -> None:
        """Wait until what these owners answered through this door has been read back."""
        session = view.fact.session
        for owner in owners:
            if not await self.replica.wait(
                session, (owner,), partial(self.replica.has_read, session, owner), READ_WAIT_S
            ):
                raise Unavailable(f"the {owner} does not answer")

    async def _newest(self, view: View, owner: str, found: Any) -> Any:
        wait_s = max(READ_WAIT_S, view.study.decider.wait_s) if view.config else READ_WAIT_S
        if not await self.replica.wait(view.fact.session, (owner,), lambda: found() is not None, wait_s):
            raise Unavailable(f"the {owner} has not answered with all that was acknowledged before")
        return found()


def _has(fact: Any, need: Seen) -> bool:
    return fact is not None and covers(fact.seen, need)


def session_body(view: View) -> dict[str, Any]:
    """A session as REST shows it."""
    fact: Session = view.fact
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"stamp", "seen"})
    if fact.state != "ended":
        data["counts"] = dict(view.counts)
    return data
