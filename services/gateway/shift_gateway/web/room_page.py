"""The room view at ``/session/NAME``: what the experimenter reads from two metres, with a participant in the room."""

from __future__ import annotations

import json
from typing import Any

from nicegui import ui
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import EndSession, Mark, SetOverride
from shift_schemas.requests import body_type
from shift_schemas.timestamps import NS
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.charts import strip_marks, strip_options, strip_points
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import Frame, explain, show_error, testid, text
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.live_page import live_session_page
from shift_gateway.web.room_elements import GazeSources, RoomElements, stimulus_script
from shift_gateway.web.room_view import WINDOW_S, RoomView, room_view

STRIP_NS = NS
"""The strip is drawn once a second: a second is six pixels of its three minutes."""
STRIP = "The last three minutes. Hatched: no valid gaze. Solid lines: decisions. Dotted lines: markers."


def add_room_page(gateway: Gateway, histories: LiveHistories) -> None:
    """Add the page."""

    @ui.page("/session/{name}")
    async def room(name: str) -> None:
        frame = Frame(f"Session {name}", links=False)
        await live_session_page(gateway, histories, name, lambda history: RoomPage(gateway, name, history, frame))


class RoomPage:
    """The elements of one open room view."""

    def __init__(self, gateway: Gateway, name: str, history: SessionHistory, frame: Frame) -> None:
        self._gateway = gateway
        self._name = name
        self._history = history
        self._shown = RoomView()
        self._marks: dict[str, Any] = {}
        self._until_ns = self._drawn_ns = 0
        study = history.study() or Study(study="default")
        self._elements = RoomElements(study)
        with ui.element("main").classes("room"):
            self._top()
            self._ended = self._elements.add_say()
            with ui.element("div").classes("right"):
                self._elements.add_state()
                self._elements.add_person()
            with ui.element("div").classes("panel strip live"):
                self._strip = ui.echart(strip_options(study.aoi_names, study.capacity.threshold))
                explain(self._strip, STRIP)
            self._controls(study, frame)
        ui.run_javascript(f"shift.strip({self._strip.id}, {WINDOW_S * 1000}, {study.capacity.threshold})")

    # --- the elements ---

    def _top(self) -> None:
        with ui.element("header").classes("top live"):
            self._title = text(tag="h1")
            with ui.element("div"):
                text("decision ", tag="span")
                self._elements.add_text("decision-number", tag="span")
                self._planned = text(tag="span")
            ui.element("span").classes("grow")
            self._sources = GazeSources()

    def _controls(self, study: Study, frame: Frame) -> None:
        with ui.element("footer").classes("controls"):
            self._note = testid(ui.input("Marker").props("dense outlined data-shortcut=m"), "marker-text")
            self._note.on("keydown.enter", self._mark)
            testid(ui.button("Mark [m]", on_click=self._mark).props("outline"), "marker")
            self._override_controls(study)
            self._pending = text("", "muted")
            ui.element("span").classes("grow")
            frame.theme_button()
            self._end_button = testid(ui.button("End… [e]", on_click=self._ask_end), "end")
            self._end_button.props("outline data-shortcut=e")
            testid(ui.link("Desk", f"/session/{self._name}/desk"), "desk")
        with ui.dialog() as self._end_dialog, ui.card():
            text("End this session? Its recording is finished then, and nothing can be added.")
            with ui.row():
                testid(ui.button("End the session", on_click=self._end).props("outline"), "end-confirm")
                ui.button("Go on", on_click=self._end_dialog.close).props("flat")

    def _override_controls(self, study: Study) -> None:
        label = "Override: task"
        if study.tasks is None:
            self._task: Any = ui.input(label).props("dense outlined").style("width: 9.5rem")
        else:
            self._task = ui.select(study.tasks, label=label, value=study.tasks[0]).props("dense outlined options-dense")
            self._task.style("min-width: 9.5rem")
        testid(self._task, "override-task")
        self._levels: dict[str, ui.select] = {}
        for strategy, settings in study.scoring.strategies.items():
            choice = ui.select(settings.levels, label=strategy, value=settings.levels[0])
            choice.props("dense outlined options-dense").style("min-width: 8rem")
            self._levels[strategy] = testid(choice, f"override-{strategy}")
        button = testid(ui.button("Override", on_click=self._override).props("outline"), "override")
        explain(button, "The strategy of the task's next decision, instead of the learner's choice.")

    # --- what a click does ---

    async def _mark(self) -> None:
        words = str(self._note.value or "").strip()
        if not words:
            ui.notify("Write what happened, then press Mark.", type="warning")
            return
        try:
            await self._gateway.api.command(Mark, self._name, body_type(Mark)(text=words))
        except ShiftError as e:
            show_error(e)
            return
        self._note.value = ""
        ui.notify("The marker is kept.", type="positive")

    async def _override(self) -> None:
        strategy = {name: choice.value for name, choice in self._levels.items()}
        try:
            body = body_type(SetOverride)(task=str(self._task.value or "").strip(), strategy=strategy)
            await self._gateway.api.command(SetOverride, self._name, body)
        except ShiftError as e:
            show_error(e)
        except ValueError:
            ui.notify("Name the task that is overridden: letters, digits, _ and -.", type="warning")

    def _ask_end(self) -> None:
        self._end_dialog.open()

    async def _end(self) -> None:
        self._end_dialog.close()
        try:
            await self._gateway.api.command(EndSession, self._name)
        except ShiftError as e:
            show_error(e)

    # --- what changes ---

    def update(self) -> str:
        """Show the present; return the JavaScript that the browser runs for the charts."""
        now_ns = self._gateway.api.clock.now().ns
        view = room_view(self._history, now_ns)
        if view != self._shown:
            self._show(view)
            self._shown = view
        return stimulus_script(view) + self._strip_script(now_ns)

    def _strip_script(self, now_ns: int) -> str:
        """Return the JavaScript that adds to the strip what is new, every :data:`STRIP_NS`."""
        if now_ns < self._drawn_ns + STRIP_NS:
            return ""
        self._drawn_ns = now_ns
        points = strip_points(self._history, self._until_ns, now_ns)
        self._until_ns = self._history.observations.times[-1] if self._history.observations.times else 0
        marks = strip_marks(self._history, now_ns)
        changed = {k: v for k, v in marks.items() if v != self._marks.get(k)}
        self._marks = marks
        given = json.dumps(points), json.dumps(changed)
        return "shift.stripUpdate({}, {}, {}, {});".format(self._strip.id, now_ns // 1_000_000, *given)

    def _show(self, view: RoomView) -> None:
        self._title.text = f"{view.participant} · {view.study} · {view.elapsed} ·"
        self._planned.text = f"/{view.planned}" + (f" · {view.task}" if view.task else "")
        self._elements.show(view)
        self._pending.text = "; ".join(f"next {task}: {strategy}" for task, strategy in view.overrides.items())
        self._sources.show(view.sources)
        if has_ended(view.state) and not self._end_button.props.get("disable"):
            self._end_button.disable()
            with self._ended:
                ui.link("This session has ended: open its recording", f"/recordings/{self._name}.mcap")
