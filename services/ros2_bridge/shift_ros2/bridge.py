"""The bridge: it turns ROS messages into commands of the mesh, and facts of the mesh into ROS messages.

It knows no transport: a backend calls it with what arrived, and it calls the same mesh API as the gateway. A request
is answered when everything that arrived before it is in the mesh, or after a time limit.
"""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from functools import partial
from typing import Any

import structlog
from shift_runtime.clock import Clock
from shift_runtime.mesh_api import READ_WAIT_S, MeshApi, new_id
from shift_runtime.metrics import Metrics
from shift_schemas.errors import FieldError, MalformedMessage, ShiftError, Unavailable, UnknownThing
from shift_schemas.messages import AoiPositions, Decision, Fact
from shift_schemas.requests import MarkerBody, StartBody
from shift_sources.gaze_batching import MOST_SOURCES, GazeArrival
from shift_sources.gaze_forwarder import Batching, GazeForwarder
from shift_sources.gaze_sink import MeshSink

from shift_ros2 import mapping
from shift_ros2.backend import Answer, Backend
from shift_ros2.command_queue import CommandQueue
from shift_ros2.diagnostics import Diagnostics
from shift_ros2.interfaces import PUBLISHED
from shift_ros2.ros4hri import Persons
from shift_ros2.settings import BridgeSettings

log = structlog.get_logger()
GAZE_WAIT_S = 0.2
"""How long a request waits for gaze that came before it (docs/design.md)."""
SESSIONS = 64
"""Sessions with gaze at a time; a further one replaces one that is idle."""
BIND_EVERY_S = 1.0


class Bridge:
    """One bridge between a ROS node and the mesh. :meth:`run` continues until it is cancelled."""

    backend: Backend

    def __init__(self, settings: BridgeSettings, mesh: MeshApi, metrics: Metrics, clock: Clock) -> None:
        self.settings = settings
        self.mesh = mesh
        self.metrics = metrics
        self.clock = clock
        self.session = settings.bound_session
        self.diagnostics = Diagnostics(settings.diagnostics_s)
        self._next_task = (self.session, settings.task)
        self._forwarders: OrderedDict[str, GazeForwarder] = OrderedDict()
        self._commands = CommandQueue(self.on_lost)
        self._aois = CommandQueue(self.on_lost)
        """AOIs that moved; they do not wait for reports."""
        self._last_aois: dict[str, AoiPositions] = {}
        """By gaze source, the last message."""
        self._persons = Persons()
        self._attached: set[str] = set()
        self._published_early: set[str] = set()
        """Decisions that were published with their answer, before the fact came back."""
        self._bound = False

    async def run(self) -> None:
        """Bind to the session, send commands and publish diagnostics, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._commands.run())
            tasks.create_task(self._aois.run())
            tasks.create_task(self._bind())
            tasks.create_task(self._publish_diagnostics())

    async def drain(self, wait_s: float) -> None:
        """Send what has arrived, for ``wait_s`` seconds at most, and close the forwarders."""
        until = asyncio.get_running_loop().time() + wait_s
        for forwarder in list(self._forwarders.values()):
            await forwarder.flush(max(0.0, until - asyncio.get_running_loop().time()))
        for queue in (self._aois, self._commands):
            await queue.flush(max(0.0, until - asyncio.get_running_loop().time()))
        for forwarder in self._forwarders.values():
            forwarder.close()

    # --- called by a backend ---

    def on_text(self, topic: str, text: str) -> None:
        """Handle a message. Raise :class:`ShiftError`."""
        self.diagnostics.count_received(topic)
        match topic:
            case "gaze":
                self._forward_gaze(mapping.gaze_of(text, self.settings.source, self.clock.now().ns / 1e9))
            case "aois":
                self._move_aois(mapping.aois_of(text, self.settings.source, self.clock.now().ns / 1e9))
            case "task":
                message = mapping.task_of(text)
                self._next_task = (message.session or self.session, message.task)
            case "task_performance":
                report = mapping.performance_of(text)
                session = report.session or self.session
                self._commands.put(topic, partial(self._report, session, report))

    async def on_request(self, request_id: str | None) -> Answer:
        """Return the answer of the service: the next strategy, or why there is none."""
        self.diagnostics.count_received("next_strategy")
        try:
            answer = await self._decide(request_id)
        except ShiftError as e:
            self.on_lost("next_strategy", e)
            return False, mapping.text_of_error(e)
        except Exception:
            log.exception("a request failed")
            error = ShiftError("something went wrong inside the bridge; see its log")
            self.on_lost("next_strategy", error)
            return False, mapping.text_of_error(error)
        return True, answer

    def on_tracked(self, persons: list[str]) -> None:
        """Mark a change of the tracked persons (ROS4HRI)."""
        self._mark(self._persons.tracked(persons))

    def on_engagement(self, person: str, level: int) -> None:
        """Mark a change of a person's engagement (ROS4HRI)."""
        self._mark(self._persons.engagement(person, level))

    def on_lost(self, topic: str, error: ShiftError, count: int = 1, reason: str = "") -> None:
        """Count lost messages; the next diagnostics report them."""
        self.diagnostics.count_lost(topic, error, count, reason)
        self.metrics.dropped(reason or ("malformed" if isinstance(error, MalformedMessage) else "refused"), count)

    def _gaze_lost(self, topic: str, error: ShiftError, count: int) -> None:
        self.on_lost(topic, error, count)

    # --- from ROS into the mesh ---

    def _forward_gaze(self, arrival: GazeArrival) -> None:
        session = arrival.session or self.session
        forwarder = self._forwarders.get(session) or self._new_forwarder(session)
        self._forwarders.move_to_end(session)
        forwarder.put(arrival)

    def _move_aois(self, message: mapping.AoisMessage) -> None:
        """Send AOIs that moved. Two of one millisecond get numbers that rise."""
        positions = message.positions
        last = self._last_aois.pop(positions.source, None)
        if last is not None and last.seq >= positions.seq and last.t < positions.t:
            positions = positions.model_copy(update={"seq": last.seq + 1})
        self._last_aois[positions.source] = positions
        if len(self._last_aois) > MOST_SOURCES:
            del self._last_aois[next(iter(self._last_aois))]
        session = message.session or self.session
        self._aois.put("aois", partial(self._send_aois, session, positions))

    async def _send_aois(self, session: str, positions: AoiPositions) -> None:
        await self._attach(session)
        await self.mesh.aois(session, positions)

    def _new_forwarder(self, session: str) -> GazeForwarder:
        if len(self._forwarders) >= SESSIONS:
            idle = next((of for of, forwarder in self._forwarders.items() if forwarder.idle), None)
            if idle is None:
                raise Unavailable(f"gaze of {SESSIONS} sessions waits already; there is no room for another")
            self._forwarders.pop(idle).close()
        batching = Batching(self.settings.gaze_chunk, self.settings.gaze_wait_s)
        forwarder = GazeForwarder(MeshSink(self.mesh), session, batching, self._attach, self._gaze_lost)
        self._forwarders[session] = forwarder
        return forwarder

    async def _report(self, session: str, report: mapping.PerformanceMessage) -> None:
        await self._attach(session)
        await self.mesh.report(session, report.body)

    async def _decide(self, request_id: str | None) -> str:
        session, task = self._next_task
        if task is None:
            rule = 'publish {"task": "..."} on shift/task before the request, or set parameter task'
            raise MalformedMessage(f"task: {rule}", (FieldError(field="task", value="", rule=rule),))
        await self._attach(session)
        if (forwarder := self._forwarders.get(session)) is not None and not forwarder.idle:
            await forwarder.flush(GAZE_WAIT_S)
        for queue in (self._aois, self._commands):
            await queue.flush(READ_WAIT_S)
        answer, repeat = await self.mesh.decide(session, task, request_id)
        text = mapping.text_of_answer(answer)
        if not repeat:
            self._publish_before_reply(session, answer, text)
        return text

    def _publish_before_reply(self, session: str, answer: dict[str, Any], text: str) -> None:
        """Publish before replying, so that a crash cannot leave an acknowledged decision unpublished."""
        decision_id: str = answer["decision_id"]
        if decision_id not in self.mesh.read_model.views[session].decisions:
            self._published_early.add(decision_id)
            self._publish_decision(text, answer.get("text"))

    def _publish_decision(self, text: str, said: str | None) -> None:
        """Publish a decision, and ``said``, which is what the robot says, for a text-to-speech node."""
        self.backend.publish("decision", text)
        if said:
            self.backend.publish("say", said)

    def _mark(self, text: str | None) -> None:
        if text is not None:
            body = MarkerBody(text=text, marker_id=new_id("m-"))  # a repeat must carry the same id
            self._commands.put("ros4hri", partial(self.mesh.mark, self.session, body))

    # --- from the mesh to ROS ---

    async def _bind(self) -> None:
        while not self._bound:
            try:
                await self._attach(self.session)
                self._bound = self.session in self._attached
                if not self._bound:
                    self.diagnostics.set_state(f"waits: for the {', the '.join(self.mesh.read_model.missing)}")
            except UnknownThing:
                await self._start_session()
            except ShiftError as e:
                self.diagnostics.set_state(f"waits: {e.detail}")
            if not self._bound:
                await asyncio.sleep(BIND_EVERY_S if not self.settings.create_session else 0.2)

    async def _start_session(self) -> None:
        settings = self.settings
        if not settings.create_session:
            self.diagnostics.set_state(
                f"waits: there is no session {self.session}; begin it, or set create_session:=true"
            )
            return
        body = StartBody(
            participant=settings.participant, session=self.session, study=settings.study,
            seed=settings.seed, condition=settings.condition,
        )  # fmt: skip
        try:
            await self.mesh.start(body)
            log.info("session begun", session=self.session, study=settings.study)
        except ShiftError as e:
            self.diagnostics.set_state(f"waits: session {self.session} cannot begin: {e.detail}")

    async def _attach(self, session: str) -> None:
        """Publish the facts of a session from now on. Raise :class:`UnknownThing` if it does not exist."""
        if session in self._attached:
            return
        view = await self.mesh.read_model.view(session)
        if session not in self._attached and not self.mesh.read_model.missing:  # old facts are not published again
            self._attached.add(session)
            view.listeners.append(self._publish)

    def _publish(self, fact: Fact, payload: str) -> None:
        if fact.subject not in PUBLISHED:
            return
        if isinstance(fact, Decision) and fact.decision_id in self._published_early:
            self._published_early.discard(fact.decision_id)
            return
        text = mapping.text_of_fact(fact, payload)
        if isinstance(fact, Decision):
            self._publish_decision(text, fact.text)
        else:
            self.backend.publish(fact.subject, text)

    async def _publish_diagnostics(self) -> None:
        while True:
            self.publish_diagnostics()
            await asyncio.sleep(min(0.25, self.settings.diagnostics_s))

    def publish_diagnostics(self) -> None:
        """Publish the diagnostics if something changed and enough time has passed."""
        waits = self.backend.state
        if self._bound:
            self.diagnostics.set_state(f"waits: {waits}" if waits else "ready")
        where = {"node": self.settings.node, "session": self.session, "backend": self.settings.backend}
        text = self.diagnostics.report(time.monotonic(), **where)
        if text is not None:
            self.backend.publish("diagnostics", text)
            log.info("diagnostics", text=text)
