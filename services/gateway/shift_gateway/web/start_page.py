"""The start page at ``/``: what to do first, the equipment, the start of a session, and the sessions."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import Any

from nicegui import ui
from shift_runtime.study_files import list_studies
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Fact, Gaze, StartSession
from shift_schemas.requests import body_type

from shift_gateway.gateway import Gateway
from shift_gateway.web.gaze_quality import WINDOW_NS, qualities
from shift_gateway.web.history import Series, summary_of
from shift_gateway.web.layout import Frame, explain, show_error, testid, text
from shift_gateway.web.preflight import Preflight
from shift_gateway.web.start_view import (
    Check,
    StudyChoice,
    proposed_participant,
    session_row,
    source_check,
    study_choice,
)

UPDATE_S = 1.0
NO_CONDITION = "none"
COLUMNS = {
    "participant": "Pseudonym of the participant.",
    "session": "Id of the session.",
    "study": "Id of the study (docs/study.md).",
    "condition": "The study's condition; 'blinded' while a blinded study runs.",
    "state": "live, ending or ended.",
    "started": "When it began, time of this machine.",
    "duration": "From its start to its end or to now.",
    "decisions": "How many decisions were made.",
    "results": "How many results were reported, corrections included.",
}
START_LINE = """curl -X POST {origin}/v1/sessions -d '{{"participant": "P01", "session": "s1"}}'"""
GAZE_LINE = (
    "curl -X POST {origin}/v1/sessions/s1/gaze "
    """-d '{{"source": "test", "seq": 0, "t": [0.0, 0.1], "aoi": ["left", "left"]}}'"""
)
DECIDE_LINE = """curl -X POST {origin}/v1/sessions/s1/decisions -d '{{"task": "grasp"}}'"""
STEPS = (
    ("Start a session", "Fill in the form below, or send:", START_LINE),
    ("Stream gaze", "Send gaze from your eye tracker's program (docs/trackers.md), such as one chunk:", GAZE_LINE),
    ("Ask how to explain", "Ask for the next decision; then report how the task went (/docs):", DECIDE_LINE),
)


def add_start_page(gateway: Gateway) -> None:
    """Add the page."""
    preflight = Preflight(gateway)

    @ui.page("/")
    async def start() -> None:
        Frame("Start")
        client = ui.context.client
        await client.connected()
        page = StartPage(gateway, preflight, await ui.run_javascript("location.origin"))
        client.on_delete(page.close)
        await page.fill()
        ui.timer(UPDATE_S, page.update)


@dataclass
class _Listener:
    """The gaze of one live session, as long as the page is open."""

    chunks: Series[Any] = field(default_factory=Series)

    def on_fact(self, fact: Fact, payload: str) -> None:
        """Keep the summary of a chunk of gaze."""
        if isinstance(fact, Gaze):
            self.chunks.append(fact.stamp.ns, summary_of(fact))
            self.chunks.forget_before(fact.stamp.ns - 2 * WINDOW_NS)


class StartPage:
    """The elements of one open start page."""

    def __init__(self, gateway: Gateway, preflight: Preflight, origin: str) -> None:
        self._gateway = gateway
        self._preflight = preflight
        self._listeners: dict[str, _Listener] = {}
        self._checks: dict[str, ui.label] = {}
        self._studies: dict[str, StudyChoice] = {}
        self._blinded: set[str] = set()
        with ui.element("div").classes("page"):
            text("How should the robot phrase its next explanation for this person, now?", tag="h1")
            self._steps = _steps(origin)
            with ui.element("div").classes("columns"):
                with ui.element("section").classes("panel"):
                    text("Before the session", tag="h2")
                    self._list = ui.element("div").classes("checks live").props('role="status"')
                self._form()
            self._table()

    # --- the elements ---

    def _form(self) -> None:
        with ui.element("section").classes("panel form"):
            text("Start a session", tag="h2")
            self._participant = testid(ui.input("Participant (pseudonym)").props("outlined dense"), "start-participant")
            self._study = ui.select({}, label="Study", on_change=self._on_study).props("outlined dense options-dense")
            testid(self._study, "start-study")
            self._condition = ui.select([], label="Condition").props("outlined dense options-dense")
            explain(testid(self._condition, "start-condition"), "The condition that this participant is in.")
            with ui.expansion("More").classes("more"):
                seed = ui.input("Seed (empty: made from the session’s id)").props("outlined dense")
                self._seed = testid(seed, "start-seed")
                session = ui.input("Session id (empty: a new one)").props("outlined dense")
                self._session = testid(session, "start-session")
            self._remarks = ui.element("div").classes("muted")
            testid(ui.button("Start", on_click=self._start).props("outline"), "start")

    def _table(self) -> None:
        columns = [{"name": n, "label": n, "field": n, "align": "left", "sortable": True} for n in (*COLUMNS, "open")]
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("bar"):
                text("Sessions", tag="h2")
                ui.element("span").classes("grow")
                search = ui.input("Search").props("outlined dense clearable")
            self._sessions = testid(ui.table(columns=columns, rows=[], row_key="session", pagination=20), "sessions")
            self._sessions.classes("sessions live").props("flat dense").bind_filter_from(search, "value")
            self._sessions.add_slot("body-cell-open", LINKS)

    # --- what is filled in once ---

    async def fill(self) -> None:
        """Read the studies and show everything a first time."""
        found = await asyncio.to_thread(list_studies, self._gateway.settings.data / "studies")
        self._studies = {choice.name: choice for choice in map(study_choice, found)}
        self._blinded = {f.study.study for f in found if f.study is not None and f.study.blinded}
        self._study.set_options({n: c.label for n, c in self._studies.items()}, value="default")
        await self.update()
        known = [view.fact.participant for view in self._gateway.read_model.views.values()]
        self._participant.value = proposed_participant(known)

    def _on_study(self) -> None:
        choice = self._studies.get(str(self._study.value))
        conditions = list(choice.conditions) if choice else []
        self._condition.set_options(conditions or [NO_CONDITION], value=None if conditions else NO_CONDITION)
        self._condition.set_enabled(bool(conditions))
        self._remarks.clear()
        with self._remarks:
            for sentence in choice.remarks if choice else ():
                text(sentence, "" if choice and choice.startable else "warning")

    # --- what a click does ---

    async def _start(self) -> None:
        choice = self._studies.get(str(self._study.value))
        if choice is None or not choice.startable:
            ui.notify("This study has mistakes; correct them, or choose another one.", type="warning")
            return
        if choice.conditions and self._condition.value is None:
            ui.notify(f"Choose the condition: {', '.join(choice.conditions)}.", type="warning")
            return
        try:
            body = body_type(StartSession).model_validate(self._given(choice))
            session, _ = await self._gateway.api.start(body)
        except ShiftError as e:
            show_error(e)
        except ValueError as e:
            ui.notify(_rule(e), type="warning", multi_line=True)
        else:
            ui.navigate.to(f"/session/{session['session']}")

    def _given(self, choice: StudyChoice) -> dict[str, Any]:
        seed = str(self._seed.value or "").strip()
        if seed and not (seed.isascii() and seed.isdigit()):
            raise ValueError("the seed is a whole number of at least 0, or empty")
        given = {
            "participant": str(self._participant.value or "").strip(),
            "study": choice.name,
            "session": str(self._session.value or "").strip() or None,
            "seed": int(seed) if seed else None,
            "condition": self._condition.value if choice.conditions else None,
        }
        return {name: value for name, value in given.items() if value is not None}

    # --- what changes ---

    async def update(self) -> None:
        """Show the checks and the sessions as they are now."""
        checks = await self._preflight.checks()
        now_ns = self._gateway.api.clock.now().ns
        self._listen()
        for session, listener in self._listeners.items():
            found = qualities(listener.chunks.until(), now_ns)
            checks = [*checks, *(source_check(session, quality, now_ns) for quality in found.values())]
        for check in checks:
            self._show(check)
        views = sorted(self._gateway.read_model.views.values(), key=lambda v: -v.fact.started.ns)
        rows = [self._row(view.fact.model_dump(mode="json"), dict(view.counts), now_ns) for view in views]
        if rows != self._sessions.rows:
            self._sessions.rows[:] = rows
            self._sessions.update()
        self._steps.set_visibility(not rows)
        if all(check.heard_ns is not None and check.level != "fault" for check in checks if check.name == "recorder"):
            ui.run_javascript(f"shift.heard({now_ns // 1_000_000})")

    def _row(self, session: dict[str, Any], counts: dict[str, int], now_ns: int) -> dict[str, Any]:
        known = {**session, "counts": session["counts"] or counts}
        return session_row(known, session["study"] in self._blinded, now_ns)

    def _show(self, check: Check) -> None:
        name = {"disk": "disk", "lag": "lag"}.get(check.name) or (
            f"service-{check.name}" if check.name in SERVICES else f"gaze-source-{check.name}"
        )
        if name not in self._checks:
            with self._list:
                self._checks[name] = text("", "", name)
        self._checks[name].text = f"{check.text}"
        self._checks[name].classes(replace=f"check {check.level}")

    def _listen(self) -> None:
        """Listen to the gaze of each live session."""
        for name, view in self._gateway.read_model.views.items():
            if name not in self._listeners and not has_ended(view.fact.state):
                self._listeners[name] = _Listener()
                view.listeners.append(self._listeners[name].on_fact)

    def close(self) -> None:
        """Stop listening: the page is closed."""
        for name, listener in self._listeners.items():
            view = self._gateway.read_model.views.get(name)
            if view is not None and listener.on_fact in view.listeners:
                view.listeners.remove(listener.on_fact)
        self._listeners.clear()


SERVICES = ("recorder", "monitor", "decider", "learner", "gateway")
LINKS = """
<q-td :props="props">
  <a :href="'/session/' + props.row.session">room</a>&nbsp;
  <a :href="'/session/' + props.row.session + '/desk'">desk</a>&nbsp;
  <a v-if="props.row.recording" :href="'/recordings/' + props.row.recording">recording</a>
</q-td>
"""


def _steps(origin: str) -> ui.stepper:
    """Show a newcomer what to do, in three steps."""
    with ui.stepper().props("vertical flat").classes("panel steps") as stepper:
        for number, (title, words, command) in enumerate(STEPS):
            with ui.step(title):
                text(words)
                line = command.format(origin=origin)
                with ui.element("pre").props('tabindex="0"'):
                    text(line, tag="code")
                with ui.stepper_navigation():
                    ui.button("Copy", on_click=lambda line=line: ui.clipboard.write(line)).props("outline dense")
                    if number + 1 < len(STEPS):
                        ui.button("Next", on_click=stepper.next).props("outline dense")
                    if number:
                        ui.button("Back", on_click=stepper.previous).props("flat dense")
    return stepper


def _rule(error: ValueError) -> str:
    found = getattr(error, "errors", None)
    if found is None:
        return str(error)
    first = found()[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
