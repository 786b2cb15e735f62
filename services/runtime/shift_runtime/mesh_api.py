"""The commands as every client of the mesh needs them: REST and ROS 2 share this class.

It remembers what was answered. A later request requires all of it, so that every client reads its own writes.
"""

from __future__ import annotations

import secrets
from functools import partial
from typing import Any

from pydantic import BaseModel, ValidationError
from shift_schemas.errors import Unavailable, UnknownThing, malformed
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import (
    Answer,
    AoiPositions,
    Command,
    Decide,
    GazeChunk,
    Mark,
    ReportPerformance,
    StartSession,
)
from shift_schemas.requests import PerformanceBody, body_type

from shift_runtime.mesh_client import MeshClient
from shift_runtime.read_model import ReadModel, SessionView

READ_WAIT_S = 2.0
"""How long a read waits for what it requires, at least; a study's ``wait_s`` can make it longer."""


def new_id(prefix: str) -> str:
    """Return a random id that begins with ``prefix``."""
    return f"{prefix}{secrets.token_hex(8)}"


class MeshApi:
    """The commands of the mesh. Each method returns what the client is answered, and raises the error tree's errors."""

    def __init__(self, mesh: MeshClient, read_model: ReadModel) -> None:
        self.mesh = mesh
        self.read_model = read_model

    async def command(
        self, kind: type[Command], session: str, body: BaseModel | None = None, **further: str
    ) -> tuple[dict[str, Any], bool]:
        """Carry out a command in a session that exists. Return its result, and whether it was carried out before.

        Parameters
        ----------
        body
            An instance of the command's :func:`body_type`; None for a command without a body.
        further
            The fields that are not in the body (``query_fields`` of the command).
        """
        view = await self.read_model.view(session)
        fields = {**(kind.fields_in(body) if body is not None else {}), **further}
        try:
            command = kind(
                command_id=kind.id_in(body) or new_id(kind.id_prefix), session=session, need=view.required, **fields
            )
        except ValidationError as e:
            raise malformed(kind.procedure, e) from e
        if isinstance(command, ReportPerformance) and not has_ended(view.fact.state):
            await self._check_decision(session, view, command.decision_id)
        answer = await self.mesh.command(command, await self._wait_s(view) if kind.wait_s is None else kind.wait_s)
        fact = kind.result
        numbers = {fact.subject: answer.result[fact.number]} if fact is not None and fact.number else {}
        self._remember(session, answer, numbers)
        if isinstance(command, Decide):
            view.made.add(command.command_id)
        return kind.answer_in(answer.result), answer.repeat

    async def start(self, body: BaseModel) -> tuple[dict[str, Any], bool]:
        """Begin a session. Return the session, and whether the same start began it before.

        A repeat gets the first result with what has changed since: the session may be ending or have ended.
        """
        fields = StartSession.fields_in(body)
        session = getattr(body, StartSession.id_field) or new_id("s-")
        answer = await self.mesh.command(StartSession(command_id=StartSession.fixed_id, session=session, **fields))
        view = await self.read_model.view(session)
        self._remember(session, answer, {"config": 1})
        if not answer.repeat:
            return answer.result, False
        await self._read(view, ("recorder",))
        return view.fact.model_dump(mode="json", include=set(answer.result)), True

    async def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        """Send gaze to the monitor; it answers once the chunk is in its journal."""
        await self.read_model.view(session)
        answer = await self.mesh.send(session, chunk)
        self._remember(session, answer, {"observation": answer.result["observation"]})
        return {name: answer.result[name] for name in ("accepted", "warnings") if name in answer.result}

    async def aois(self, session: str, positions: AoiPositions) -> dict[str, Any]:
        """Send AOIs that moved to the monitor; it answers once they are in its journal."""
        await self.read_model.view(session)
        answer = await self.mesh.send(session, positions)
        self._remember(session, answer, {})
        return {name: answer.result[name] for name in ("accepted", "warnings") if name in answer.result}

    async def decide(self, session: str, task: str, decision_id: str | None = None) -> tuple[dict[str, Any], bool]:
        """Make the next decision."""
        return await self.command(Decide, session, body_type(Decide)(task=task, decision_id=decision_id))

    async def report(self, session: str, body: PerformanceBody) -> tuple[dict[str, Any], bool]:
        """Report how the task went."""
        return await self.command(ReportPerformance, session, body)

    async def mark(self, session: str, body: BaseModel) -> tuple[dict[str, Any], bool]:
        """Note something in the recording."""
        return await self.command(Mark, session, body)

    def _remember(self, session: str, answer: Answer, numbers: dict[str, int]) -> None:
        """Require what was answered in all later requests; ``numbers`` are counted as :class:`Seen` counts them."""
        view = self.read_model.views.get(session)
        if view is not None:
            for count, number in numbers.items():
                view.answered[count] = max(view.answered[count], number)
            view.sequences[answer.owner] = max(view.sequences.get(answer.owner, 0), answer.seq)

    async def _wait_s(self, view: SessionView) -> float:
        await self._read(view, ("recorder",))
        return view.study.decider.wait_s

    async def _check_decision(self, session: str, view: SessionView, decision_id: str) -> None:
        if decision_id not in view.decisions and decision_id not in view.made:
            if not await self.read_model.reader.pull("decider"):
                raise Unavailable(
                    f"the decider does not answer, so it is not known whether decision {decision_id} exists"
                )
            if decision_id not in view.decisions:
                raise UnknownThing(f"session {session} has no decision {decision_id}")

    async def _read(self, view: SessionView, owners: tuple[str, ...]) -> None:
        """Wait until the read model has all that these owners answered through this class."""
        session = view.fact.session
        for owner in owners:
            there = partial(self.read_model.has_read, session, owner)
            if not there() and not await self.read_model.wait(session, (owner,), there, READ_WAIT_S):
                raise Unavailable(f"the {owner} does not answer")
