"""The bridge: what ROS messages do in the mesh, and what of the mesh becomes ROS messages.

It knows no transport: a backend tells it what arrived, a door does it, as the gateway's does. A request is
answered when everything that arrived before it is in the mesh, or had its time.
"""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from functools import partial

import structlog
from shift_runtime.clock import Clock
from shift_runtime.mesh_api import READ_WAIT_S, MeshApi, new_id
from shift_runtime.metrics import Metrics
from shift_schemas.errors import FieldError, MalformedMessage, ShiftError, Unavailable, UnknownThing
from shift_schemas.messages import Decision, Fact
from shift_schemas.requests import MarkerBody, StartBody

from shift_ros2 import mapping
from shift_ros2.backend import Answer, Backend
from shift_ros2.command_queue import Reports
from shift_ros2.diagnostics import Diagnostics
from shift_ros2.gaze_forwarder import GazeSender
from shift_ros2.interfaces import PUBLISHED
from shift_ros2.mapping import GazeArrival
from shift_ros2.ros4hri import Persons
from shift_ros2.settings import BridgeSettings

log = structlog.get_logger()
GAZE_WAIT_S = 0.2
"""How long a request waits for gaze that came before it; DESIGN.md, "Read your own writes"."""
SESSIONS = 64
"""Sessions with gaze at a time; a further one takes the place of one that is quiet."""
BIND_EVERY_S = 1.0


class Bridge:
    """See the module. :meth:`run` goes on until it is cancelled."""

    backend: Backend

    def __init__(self, settings: BridgeSettings, door: MeshApi, metrics: Metrics, clock: Clock) -> None:
        self.settings = settings
        self.door = door
        self.metrics = metrics
        self.clock = clock
        self.session = settings.bound_session
        self.diagnostics = Diagnostics(settings.diagnostics_s)
        self._about = (self.session, settings.task)
        self._senders: OrderedDict[str, GazeSender] = OrderedDict()
        self._reports = Reports(self.on_lost)
        self._persons = Persons()
        self._attached: set[str] = set()
        self._ahead: set[str] = set()
        """Decisions that were put out with their answer, before the fact came back."""
        self._bound = False

    async def run(self) -> None:
        """Bind to the session, hand reports on and tell what happens, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._reports.run())
            tasks.create_task(self._bind())
            tasks.create_task(self._tell())

    async def drain(self, wait_s: float) -> None:
        """Let what arrived go through."""
        until = asyncio.get_running_loop().time() + wait_s
        for sender in list(self._senders.values()):
            await sender.passed(max(0.0, until - asyncio.get_running_loop().time()))
        await self._reports.passed(max(0.0, until - asyncio.get_running_loop().time()))
        for sender in self._senders.values():
            sender.close()

    # --- what a backend tells ---

    def on_text(self, topic: str, text: str) -> None:
        """A message came. Raises :class:`ShiftError`."""
        self.diagnostics.came(topic)
        match topic:
            case "gaze":
                self._take_gaze(mapping.gaze_of(text, self.settings.source, self.clock.now().ns / 1e9))
            case "task":
                about = mapping.task_of(text)
                self._about = (about.session or self.session, about.task)
            case "task_performance":
                report = mapping.performance_of(text)
                session = report.session or self.session
                self._reports.put(topic, partial(self._report, session, report))

    async def on_request(self, request_id: str | None) -> Answer:
        """The next strategy: what the service answers."""
        self.diagnostics.came("next_strategy")
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
        """ROS4HRI: who is tracked."""
        self._mark(self._persons.tracked(persons))

    def on_engagement(self, person: str, level: int) -> None:
        """ROS4HRI: how engaged somebody is."""
        self._mark(self._persons.engagement(person, level))

    def on_lost(self, topic: str, error: ShiftError, count: int = 1, reason: str = "") -> None:
        """Count, and tell when it is time."""
        self.diagnostics.lost(topic, error, count, reason)
        self.metrics.dropped(reason or ("malformed" if isinstance(error, MalformedMessage) else "refused"), count)

    def _gaze_lost(self, topic: str, error: ShiftError, count: int) -> None:
        self.on_lost(topic, error, count)

    # --- in ---

    def _take_gaze(self, arrival: GazeArrival) -> None:
        session = arrival.session or self.session
        sender = self._senders.get(session) or self._new_sender(session)
        self._senders.move_to_end(session)
        sender.put(arrival)

    def _new_sender(self, session: str) -> GazeSender:
        if len(self._senders) >= SESSIONS:
            quiet = next((of for of, sender in self._senders.items() if sender.quiet), None)
            if quiet is None:
                raise Unavailable(f"gaze of {SESSIONS} sessions waits already; there is no room for another")
            self._senders.pop(quiet).close()
        sender = self._senders[session] = GazeSender(self.door, self.settings, session, self._attach, self._gaze_lost)
        return sender

    async def _report(self, session: str, report: mapping.PerformanceMessage) -> None:
        await self._attach(session)
        await self.door.report(session, report.body)

    async def _decide(self, request_id: str | None) -> str:
        session, task = self._about
        if task is None:
            rule = 'publish {"task": "..."} on shift/task before the request, or set parameter task'
            raise MalformedMessage(f"task: {rule}", (FieldError(field="task", value="", rule=rule),))
        await self._attach(session)
        if (sender := self._senders.get(session)) is not None and not sender.quiet:
            await sender.passed(GAZE_WAIT_S)
        await self._reports.passed(READ_WAIT_S)
        answer, repeat = await self.door.decide(session, task, request_id)
        text = mapping.text_of_answer(answer)
        if not repeat:
            self._put_out_first(session, answer["decision_id"], text)
        return text

    def _put_out_first(self, session: str, decision_id: str, text: str) -> None:
        """A decision is heard before it is acknowledged; should we die in between, nobody was told that it is made."""
        if decision_id not in self.door.read_model.views[session].decisions:
            self._ahead.add(decision_id)
            self.backend.publish("decision", text)

    def _mark(self, text: str | None) -> None:
        if text is not None:
            body = MarkerBody(text=text, marker_id=new_id("m-"))  # one id, however often it is sent
            self._reports.put("ros4hri", partial(self.door.mark, self.session, body))

    # --- out ---

    async def _bind(self) -> None:
        while not self._bound:
            try:
                await self._attach(self.session)
                self._bound = self.session in self._attached
                if not self._bound:
                    self.diagnostics.now(f"waits: for the {', the '.join(self.door.read_model.missing)}")
            except UnknownThing:
                await self._begin()
            except ShiftError as e:
                self.diagnostics.now(f"waits: {e.detail}")
            if not self._bound:
                await asyncio.sleep(BIND_EVERY_S if not self.settings.create_session else 0.2)

    async def _begin(self) -> None:
        settings = self.settings
        if not settings.create_session:
            self.diagnostics.now(f"waits: there is no session {self.session}; begin it, or set create_session:=true")
            return
        body = StartBody(
            participant=settings.participant, session=self.session, study=settings.study,
            seed=settings.seed, condition=settings.condition,
        )  # fmt: skip
        try:
            await self.door.start(body)
            log.info("session begun", session=self.session, study=settings.study)
        except ShiftError as e:
            self.diagnostics.now(f"waits: session {self.session} cannot begin: {e.detail}")

    async def _attach(self, session: str) -> None:
        """Put out what becomes known of a session from now on. Raises :class:`UnknownThing` where there is none."""
        if session in self._attached:
            return
        view = await self.door.read_model.view(session)
        if session not in self._attached and not self.door.read_model.missing:  # what is old is not told again
            self._attached.add(session)
            view.listeners.append(self._put_out)

    def _put_out(self, fact: Fact, payload: str) -> None:
        if fact.subject not in PUBLISHED:
            return
        if isinstance(fact, Decision) and fact.decision_id in self._ahead:
            self._ahead.discard(fact.decision_id)
            return
        self.backend.publish(fact.subject, mapping.text_of_fact(fact, payload))

    async def _tell(self) -> None:
        while True:
            self.tell()
            await asyncio.sleep(min(0.25, self.settings.diagnostics_s))

    def tell(self) -> None:
        """Publish the diagnostics, if there is news and it is time."""
        waits = self.backend.state
        if self._bound:
            self.diagnostics.now(f"waits: {waits}" if waits else "ready")
        where = {"node": self.settings.node, "session": self.session, "backend": self.settings.backend}
        text = self.diagnostics.report(time.monotonic(), **where)
        if text is not None:
            self.backend.publish("diagnostics", text)
            log.info("diagnostics", text=text)
