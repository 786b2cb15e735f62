"""The gateway's door: what the REST paths do, without HTTP. To the commands it adds the reads and the preview.

Each method takes what a request says and gives what is said back; errors are the error tree's.
"""

from __future__ import annotations

import asyncio
import json
from typing import Any

from pydantic import BaseModel
from shift_decider.core import ANY_TASK, decide
from shift_runtime.clock import Clock
from shift_runtime.mesh_api import READ_WAIT_S, MeshApi
from shift_runtime.mesh_client import MeshClient
from shift_schemas.core_protocol import InputsMissing, covers
from shift_schemas.errors import FieldError, MalformedMessage, Unavailable, shorten
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Command, Observation, PatchBody, Seen, Session
from shift_schemas.timestamps import NS

from shift_gateway.session_views import ReadModel, SessionView, decider_state

PREVIEW_ID = "preview"


class GatewayApi(MeshApi):
    """See the module."""

    def __init__(self, mesh: MeshClient, read_model: ReadModel, clock: Clock) -> None:
        super().__init__(mesh, read_model)
        self.clock = clock

    async def session(self, session: str) -> dict[str, Any]:
        """The session, with counts so far."""
        view = await self.read_model.view(session)
        if not has_ended(view.fact.state):
            await self._read(view, tuple(view.sequences))
        return session_body(view)

    async def sessions(self) -> list[dict[str, Any]]:
        """Every session."""
        if not await self.read_model.reader.pull("recorder") and "recorder" in self.read_model.missing:
            raise Unavailable("the recorder does not answer, so nobody knows which sessions there are")
        live = [view for view in self.read_model.views.values() if not has_ended(view.fact.state)]
        await asyncio.gather(*(self._read(view, tuple(view.sequences)) for view in live))
        return [session_body(view) for view in self.read_model.views.values()]

    async def observation(self, session: str) -> dict[str, Any]:
        """The partner model, with all in it that was answered before."""
        view = await self._current(session, "monitor")
        version, need = view.required.observation, view.required.model_copy(update={"observation": 0, "policy": 0})

        def newest() -> Observation | None:
            found = view.observation
            return found if found is not None and found.version >= version and covers(found.seen, need) else None

        found = await self._newest(view, "monitor", newest)
        assert isinstance(found, Observation)
        data: dict[str, Any] = found.model_dump(mode="json")
        data["gaze"]["aoi"] = data["gaze"]["aoi"] or None
        if (received := found.gaze.received) is not None:
            data["gaze"]["age_s"] = max(self.clock.now().ns - received.ns, 0) / NS
        return data

    async def policy(self, session: str) -> dict[str, Any]:
        """The policy for the next decision."""
        view = await self._current(session, "learner")
        need = view.required.model_copy(update={"observation": 0, "policy": 0})
        found = await self._newest(view, "learner", lambda: view.policy if _has(view.policy, need) else None)
        data: dict[str, Any] = found.model_dump(mode="json")
        return data

    async def config(self, session: str) -> dict[str, Any]:
        """The study in force, with its version."""
        view = await self.read_model.view(session)
        await self._read(view, ("recorder",))
        if view.config is None:
            raise Unavailable("the recorder has put out no configuration of this session yet")
        return {**json.loads(view.config.study), "version": view.config.version}

    async def command(
        self, kind: type[Command], session: str, body: BaseModel | None = None
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
        return await super().command(kind, session, body)

    async def preview(self, session: str, task: str) -> dict[str, Any]:
        """What a decision made now would carry; the decider's own core on the replica, no side effect."""
        view = await self._current(session, "decider")
        wait_s = await self._wait_s(view)
        await self._read(view, ("decider",))

        def attempt(timed_out: bool) -> dict[str, Any] | None:
            try:
                found = decide(decider_state(view), task, PREVIEW_ID, view.required, self.clock.now(), timed_out)
            except InputsMissing:
                return None
            return found.model_dump(mode="json", exclude={"decision_id"})

        assert task != ANY_TASK
        came = await self.read_model.wait(
            session, ("recorder", "monitor", "learner"), lambda: attempt(False) is not None, wait_s
        )
        result = attempt(timed_out=not came)
        assert result is not None
        return result

    async def _current(self, session: str, owner: str) -> SessionView:
        """The session's view; of one that ended before this gateway began, the journal is read now."""
        view = await self.read_model.view(session)
        if has_ended(view.fact.state) and (session, owner) not in self.read_model.reader.cursors:
            silent = await self.read_model.reader.pull_all(("monitor", "decider", "learner"), session)
            if silent:
                raise Unavailable(f"the {silent[0]} does not answer")
        return view

    async def _newest(self, view: SessionView, owner: str, found: Any) -> Any:
        wait_s = max(READ_WAIT_S, view.study.decider.wait_s) if view.config else READ_WAIT_S
        if not await self.read_model.wait(view.fact.session, (owner,), lambda: found() is not None, wait_s):
            raise Unavailable(f"the {owner} has not answered with all that was acknowledged before")
        return found()


def _has(fact: Any, need: Seen) -> bool:
    return fact is not None and covers(fact.seen, need)


def session_body(view: SessionView) -> dict[str, Any]:
    """A session as REST shows it."""
    fact: Session = view.fact
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"stamp", "seen"})
    if not has_ended(fact.state):
        data["counts"] = dict(view.counts)
    return data
