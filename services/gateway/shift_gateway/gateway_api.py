"""The work behind the REST paths, without HTTP: the commands of the mesh, the reads and the preview."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any, TypeVar

from pydantic import BaseModel
from shift_decider.core import ANY_TASK, decide
from shift_runtime.clock import Clock
from shift_runtime.mesh_api import READ_WAIT_S, MeshApi
from shift_runtime.mesh_client import MeshClient
from shift_runtime.read_model import ReadModel, SessionView
from shift_schemas.core_protocol import InputsMissing, covers
from shift_schemas.errors import FieldError, MalformedMessage, Unavailable, shorten
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Command, Fact, Observation, PatchBody, Policy, Seen, Session
from shift_schemas.timestamps import NS

from shift_gateway.session_views import decider_state

PREVIEW_ID = "preview"
"""The decision id of a preview, which its answer leaves out."""
F = TypeVar("F", Observation, Policy)


class GatewayApi(MeshApi):
    """The commands, reads and preview. Each method returns the answer, and raises the error tree's errors."""

    def __init__(self, mesh: MeshClient, read_model: ReadModel, clock: Clock) -> None:
        super().__init__(mesh, read_model)
        self.clock = clock

    async def session(self, session: str) -> dict[str, Any]:
        """Return the session, with counts so far."""
        view = await self.read_model.view(session)
        if not has_ended(view.fact.state):
            await self._read(view, tuple(view.sequences))
        return session_body(view)

    async def sessions(self) -> list[dict[str, Any]]:
        """Return every session."""
        if not await self.read_model.reader.pull("recorder") and "recorder" in self.read_model.missing:
            raise Unavailable("the recorder does not answer, so it is not known which sessions exist")
        live = [view for view in self.read_model.views.values() if not has_ended(view.fact.state)]
        await asyncio.gather(*(self._read(view, tuple(view.sequences)) for view in live))
        return [session_body(view) for view in self.read_model.views.values()]

    async def observation(self, session: str) -> dict[str, Any]:
        """Return the partner model, which includes all that was answered before."""
        view = await self._current(session, "monitor")
        await self.read_model.show(session)
        version, required = view.required.observation, _of_the_inputs(view.required)

        def newest() -> Observation | None:
            found = view.observation
            return found if _has(found, required) and found is not None and found.version >= version else None

        found = await self._newest(view, "monitor", newest)
        data: dict[str, Any] = found.model_dump(mode="json")
        data["gaze"]["aoi"] = data["gaze"]["aoi"] or None
        if (received := found.gaze.received) is not None:
            data["gaze"]["age_s"] = max(self.clock.now().ns - received.ns, 0) / NS
        return data

    async def policy(self, session: str) -> dict[str, Any]:
        """Return the policy for the next decision."""
        view = await self._current(session, "learner")
        required = _of_the_inputs(view.required)
        found = await self._newest(view, "learner", lambda: view.policy if _has(view.policy, required) else None)
        data: dict[str, Any] = found.model_dump(mode="json")
        return data

    async def config(self, session: str) -> dict[str, Any]:
        """Return the study in force, with its version."""
        view = await self.read_model.view(session)
        await self._read(view, ("recorder",))
        if view.config is None:
            raise Unavailable("the recorder has not published a configuration of this session yet; ask again")
        return {**json.loads(view.config.study), "version": view.config.version}

    async def command(
        self, kind: type[Command], session: str, body: BaseModel | None = None, **further: str
    ) -> tuple[dict[str, Any], bool]:
        """Carry out a command. A patch may contain the ``version`` as it was read: it is checked, and left out."""
        if isinstance(body, PatchBody) and "version" in body.root:
            version, given = (await self.config(session))["version"], body.root["version"]
            if given != version or isinstance(given, bool):
                rule = f"it cannot be changed: it counts the changes and is {version} now; leave it out"
                raise MalformedMessage(
                    f"version: {rule}", (FieldError(field="version", value=shorten(given), rule=rule),)
                )
            body = PatchBody({name: v for name, v in body.root.items() if name != "version"})
        return await super().command(kind, session, body, **further)

    async def preview(self, session: str, task: str) -> dict[str, Any]:
        """Return what a decision made now would carry; the decider's own core runs on the read model.

        It has no side effect.
        """
        view = await self._current(session, "decider")
        wait_s = await self._wait_s(view)
        await self._read(view, ("decider",))
        await self.read_model.show(session)

        def attempt(timed_out: bool) -> dict[str, Any] | None:
            try:
                found = decide(decider_state(view), task, PREVIEW_ID, view.required, self.clock.now(), timed_out)
            except InputsMissing:
                return None
            return found.model_dump(mode="json", exclude={"decision_id"})

        assert task != ANY_TASK
        in_time = await self.read_model.wait(
            session, ("recorder", "monitor", "learner"), lambda: attempt(False) is not None, wait_s
        )
        result = attempt(timed_out=not in_time)
        assert result is not None
        return result

    async def _current(self, session: str, owner: str) -> SessionView:
        """Return the session's view. Read the journals of a session that ended before this gateway started."""
        view = await self.read_model.view(session)
        if has_ended(view.fact.state) and self.read_model.reader.cursor(session, owner) is None:
            silent = await self.read_model.reader.pull_all(("monitor", "decider", "learner"), session)
            if silent:
                raise Unavailable(f"the {silent[0]} does not answer")
        return view

    async def _newest(self, view: SessionView, owner: str, newest: Callable[[], F | None]) -> F:
        """Wait until ``newest`` finds a fact of ``owner``, and return it."""
        wait_s = max(READ_WAIT_S, view.study.decider.wait_s) if view.config else READ_WAIT_S
        await self.read_model.wait(view.fact.session, (owner,), lambda: newest() is not None, wait_s)
        found = newest()
        if found is None:
            raise Unavailable(f"the {owner} has not answered with all that was acknowledged before")
        return found


def _of_the_inputs(required: Seen) -> Seen:
    """Return what a fact must have seen of the monitor's and the learner's own inputs."""
    return required.model_copy(update={"observation": 0, "policy": 0})


def _has(fact: Fact | None, required: Seen) -> bool:
    return fact is not None and covers(fact.seen, required)


def session_body(view: SessionView) -> dict[str, Any]:
    """Return a session as REST shows it."""
    fact: Session = view.fact
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"stamp", "seen"})
    if not has_ended(fact.state):
        data["counts"] = dict(view.counts)
    return data
