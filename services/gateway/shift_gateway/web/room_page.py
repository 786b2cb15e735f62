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
from shift_study.areas import Aoi
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.charts import strip_marks, strip_options, strip_points
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import Frame, explain, show_error, testid, text
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.live_page import live_session_page
from shift_gateway.web.room_view import WINDOW_S, RoomView, room_view

STRIP_NS = NS
"""The strip is drawn once a second: a second is six pixels of its three minutes."""
LONG_SAY = 40
"""A longer text is shown a little smaller, so that it fits; characters."""
TOOLTIPS = {
    "say": "How the robot phrases its next explanation: the last decision's strategy (paper, section III-B).",
    "state": "The cognitive state: what the scoring table reduces the observations to (paper, section III-C, Table I).",
    "capacity": "Processing capacity, which explanations draw on and repetition recharges (paper, section III-A1).",
    "stimulus": "The areas of interest, and the last point of each gaze source that sends points.",
    "strip": "The last three minutes. Hatched: no valid gaze. Solid lines: decisions. Dotted lines: markers.",
}


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
        self._texts: dict[str, ui.label] = {}
        self._sources: dict[str, ui.label] = {}
        with ui.element("main").classes("room"):
            self._top(study)
            self._left()
            with ui.element("div").classes("right"):
                self._state()
                self._person(study)
            with ui.element("div").classes("panel strip live"):
                self._strip = ui.echart(strip_options(study.aoi_names, study.capacity.threshold))
                explain(self._strip, TOOLTIPS["strip"])
            self._controls(study, frame)
        ui.run_javascript(f"shift.strip({self._strip.id}, {WINDOW_S * 1000}, {study.capacity.threshold})")

    # --- the elements ---

    def _text(self, name: str, classes: str = "", tag: str = "div") -> ui.label:
        label = text("", classes, name, tag)
        assert isinstance(label, ui.label)
        self._texts[name] = label
        return label

    def _top(self, study: Study) -> None:
        with ui.element("header").classes("top live"):
            self._title = text(tag="h1")
            with ui.element("div"):
                text("decision ", tag="span")
                self._text("decision-number", tag="span")
                self._planned = text(tag="span")
            ui.element("span").classes("grow")
            self._gaze_row = ui.element("div").classes("bar").style("width: auto; flex-wrap: nowrap")
            with self._gaze_row:
                self._no_gaze = text("no gaze yet", "muted")

    def _left(self) -> None:
        with ui.element("section").classes("panel left live").props('aria-label="What to say"'):
            text("SAY IT", "caption")
            explain(self._text("say", "say"), TOOLTIPS["say"])
            self._text("strategy", "strategy muted")
            self._origin = text("", "muted")
            ui.element("span").classes("grow")
            self._text("result-pending", "pending").props('role="status"')
            self._ended = ui.element("div")

    def _state(self) -> None:
        with ui.element("section").classes("panel live").props('aria-label="Cognitive state"'):
            text("STATE", "caption")
            explain(self._text("cognitive-state", "state"), TOOLTIPS["state"])
            self._text("why", "why")
            self._changed = text("", "why muted")

    def _person(self, study: Study) -> None:
        with ui.element("div").classes("person"):
            with ui.element("section").classes("panel stimulus live").props('aria-label="Stimulus"') as stimulus:
                explain(stimulus, TOOLTIPS["stimulus"])
                ui.html(stimulus_svg(study), sanitize=False)
            with ui.element("section").classes("panel live").props('aria-label="The person"'):
                text("capacity", "caption")
                with ui.element("div").classes("bar").style("gap: .5rem; align-items: baseline"):
                    self._text("capacity", "big")
                    self._text("capacity-class")
                with ui.element("div").classes("bar-outer") as bar:
                    explain(bar, TOOLTIPS["capacity"])
                    self._bar = ui.element("div").classes("bar-inner")
                    self._threshold = ui.element("div").classes("bar-threshold")
                text("gaze", "caption")
                self._text("gaze-class", "big").style("font-size: 1.5rem")
                with ui.element("div").classes("muted"):
                    for aoi in study.aoi_names:
                        with ui.element("div"):
                            text(f"{aoi} ", tag="span")
                            self._text(f"weight-{aoi}", tag="span")

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
        looked = json.dumps([list(p) for p in view.points]), json.dumps(sorted({view.held_aoi, *view.looked_at} - {""}))
        return "shift.stimulus({}, {});".format(*looked) + self._strip_script(now_ns)

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
        values = {
            "decision-number": view.decision_number, "say": view.say, "strategy": view.strategy,
            "result-pending": view.result_pending, "cognitive-state": view.cognitive_state, "why": view.why,
            "capacity": view.capacity, "capacity-class": view.capacity_class, "gaze-class": view.gaze_class,
            **{f"weight-{aoi}": weight for aoi, weight in view.weights.items()},
        }  # fmt: skip
        for name, value in values.items():
            if name in self._texts:
                self._texts[name].text = value
        self._origin.text = view.origin
        self._changed.text = f"now: {view.changed_to}" if view.changed_to else ""
        self._texts["say"].classes(**_toggled("long", len(view.say) > LONG_SAY))
        self._bar.style(f"width: {100 * min(max(view.capacity_share, 0), 1):.0f}%")
        self._threshold.style(f"left: {100 * view.threshold_share:.0f}%")
        self._pending.text = "; ".join(f"next {task}: {strategy}" for task, strategy in view.overrides.items())
        self._show_sources(view)
        if has_ended(view.state) and not self._end_button.props.get("disable"):
            self._end_button.disable()
            with self._ended:
                ui.link("This session has ended: open its recording", f"/recordings/{self._name}.mcap")

    def _show_sources(self, view: RoomView) -> None:
        for name, quality in view.sources.items():
            if name not in self._sources:
                self._no_gaze.set_visibility(False)
                with self._gaze_row:
                    label = ui.label()
                    self._sources[name] = testid(label, f"gaze-source-{name}")
                    explain(
                        label, f"Gaze source {name}: its rate and loss in the last 5 s, and the age of its last sample."
                    )
                self._gaze_row.classes(**_toggled("many", len(self._sources) > 1))
            label = self._sources[name]
            label.text = f"GAZE {quality.text}" if len(view.sources) == 1 else f"{name} {quality.text}"
            label.classes(replace=quality.level)


def _toggled(name: str, wanted: bool) -> dict[str, str]:
    return {"add": name} if wanted else {"remove": name}


def stimulus_svg(study: Study) -> str:
    """Return the stimulus as SVG with its AOIs. Their names are ids, so that nothing in them is markup."""
    shapes = "".join(_shape(aoi) for aoi in study.aois)
    return (
        f'<svg viewBox="0 0 100 60" preserveAspectRatio="xMidYMid meet" role="img" aria-label="Areas of interest: '
        f'{", ".join(study.aoi_names)}"><rect class="aoi" x="0" y="0" width="100" height="60"/>{shapes}</svg>'
    )


def _shape(aoi: Aoi) -> str:
    if aoi.rectangle is not None:
        left, top, right, bottom = aoi.rectangle
        corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
    else:
        corners = [list(p) for p in aoi.polygon or []]
    points = " ".join(f"{100 * x:.2f},{60 * y:.2f}" for x, y in corners)
    x, y = 100 * min(c[0] for c in corners) + 1.5, 60 * min(c[1] for c in corners) + 6
    name = aoi.name
    return f'<polygon class="aoi" data-aoi="{name}" points="{points}"/><text x="{x:.2f}" y="{y:.2f}">{name}</text>'
