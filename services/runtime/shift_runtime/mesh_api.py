"""The door: what REST and ROS 2 have in common, the commands. It remembers what it answered.

Each method takes what is asked and gives what is said back; errors are the error tree's. What a door
answered is handed along as ``need`` with all that it asks afterwards.
"""

from __future__ import annotations

import secrets
from functools import partial
from typing import Any

from shift_schemas.errors import Unavailable, UnknownThing
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import (
    END_ID,
    START_ID,
    Answer,
    Command,
    Configure,
    Decide,
    EndSession,
    GazeChunk,
    Mark,
    ReportPerformance,
    SetOverride,
    StartSession,
)
from shift_schemas.requests import MarkerBody, OverrideBody, PerformanceBody, StartBody

from shift_runtime.mesh_client import MeshClient
from shift_runtime.read_model import ReadModel, SessionView

READ_WAIT_S = 2.0
"""How long a read waits for what it must have in it, at least; a study's ``wait_s`` can make it longer."""


def new_id(prefix: str) -> str:
    """An id that nobody else has."""
    return f"{prefix}{secrets.token_hex(8)}"


class MeshApi:
    """See the module."""

    def __init__(self, mesh: MeshClient, read_model: ReadModel) -> None:
        self.mesh = mesh
        self.read_model = read_model

    async def start(self, body: StartBody) -> tuple[dict[str, Any], bool]:
        """Begin a session; return the session and whether it was begun before, by the same start.

        A repeat gets the first result with what has changed since: the session may be ending or have ended.
        """
        session = body.session or new_id("s-")
        command = StartSession(
            command_id=START_ID, session=session, participant=body.participant, study=body.study,
            seed=body.seed, condition=body.condition,
        )  # fmt: skip
        answer = await self.mesh.command(command)
        view = await self.read_model.view(session)
        self._remember(session, answer, config=1)
        if not answer.repeat:
            return answer.result, False
        await self._read(view, ("recorder",))
        return view.fact.model_dump(mode="json", include=set(answer.result)), True

    async def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        """Hand gaze to the monitor; acknowledged once it is in the journal."""
        await self.read_model.view(session)
        answer = await self.mesh.gaze(session, chunk)
        self._remember(session, answer, observation=answer.result["observation"])
        return {name: answer.result[name] for name in ("accepted", "warnings") if name in answer.result}

    async def decide(self, session: str, task: str, decision_id: str | None = None) -> tuple[dict[str, Any], bool]:
        """The next decision."""
        view = await self.read_model.view(session)
        command = Decide(command_id=decision_id or new_id("d-"), session=session, task=task, need=view.required)
        answer = await self.mesh.command(command, wait_s=await self._wait_s(view))
        self._remember(session, answer, decision=answer.result["n"])
        return answer.result, answer.repeat

    async def report(self, session: str, body: PerformanceBody) -> tuple[dict[str, Any], bool]:
        """How the task went."""
        view = await self.read_model.view(session)
        if not has_ended(view.fact.state):
            await self._check_decision(session, view, body.decision_id)
        command = ReportPerformance(
            command_id=new_id("c-") if body.corrects else body.decision_id, session=session, need=view.required,
            comprehension=body.comprehension, enabledness=body.enabledness,
            corrects=body.decision_id if body.corrects else None,
        )  # fmt: skip
        answer = await self.mesh.command(command, wait_s=READ_WAIT_S)
        self._remember(session, answer, performance=answer.result["n"])
        result = dict(answer.result)
        for dimension in ("comprehension", "enabledness"):
            result[dimension] = result[dimension]["value"]
        return result, answer.repeat

    async def override(self, session: str, body: OverrideBody) -> tuple[dict[str, Any], bool]:
        """Choose the task's next strategy."""
        view = await self.read_model.view(session)
        command = SetOverride(
            command_id=body.override_id or new_id("o-"), session=session, need=view.required,
            task=body.task, strategy=body.strategy, reason=body.reason,
        )  # fmt: skip
        return await self._plain(session, command, await self._wait_s(view))

    async def mark(self, session: str, body: MarkerBody) -> tuple[dict[str, Any], bool]:
        """Note something."""
        await self.read_model.view(session)
        return await self._plain(
            session, Mark(command_id=body.marker_id or new_id("m-"), session=session, text=body.text)
        )

    async def configure(self, session: str, patch: dict[str, Any]) -> dict[str, Any]:
        """Change the study in force."""
        await self.read_model.view(session)
        answer = await self.mesh.command(Configure(command_id=new_id("c-"), session=session, patch=patch))
        self._remember(session, answer, config=answer.result["version"])
        return answer.result

    async def end(self, session: str) -> dict[str, Any]:
        """End the session; answered once its recording is finished."""
        await self.read_model.view(session)
        answer = await self.mesh.command(EndSession(command_id=END_ID, session=session), wait_s=10.0)
        self._remember(session, answer)
        return answer.result

    async def _plain(self, session: str, command: Command, wait_s: float = 0.0) -> tuple[dict[str, Any], bool]:
        answer = await self.mesh.command(command, wait_s)
        self._remember(session, answer)
        return answer.result, answer.repeat

    def _remember(self, session: str, answer: Answer, **counts: int) -> None:
        view = self.read_model.views.get(session)
        if view is not None:
            for count, number in counts.items():
                view.answered[count] = max(view.answered[count], number)
            view.sequences[answer.owner] = max(view.sequences.get(answer.owner, 0), answer.seq)

    async def _wait_s(self, view: SessionView) -> float:
        await self._read(view, ("recorder",))
        return view.study.decider.wait_s

    async def _check_decision(self, session: str, view: SessionView, decision_id: str) -> None:
        if decision_id not in view.decisions:
            if not await self.read_model.reader.pull("decider"):
                raise Unavailable("the decider does not answer, so nobody knows whether there is such a decision")
            if decision_id not in view.decisions:
                raise UnknownThing(f"session {session} has no decision {decision_id}")

    async def _read(self, view: SessionView, owners: tuple[str, ...]) -> None:
        """Wait until what these owners answered through this door has been read back."""
        session = view.fact.session
        for owner in owners:
            there = partial(self.read_model.has_read, session, owner)
            if not there() and not await self.read_model.wait(session, (owner,), there, READ_WAIT_S):
                raise Unavailable(f"the {owner} does not answer")
