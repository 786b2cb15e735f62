"""The desk view at ``/session/NAME/desk``: how the learning goes, and what a person can change while it runs."""

from __future__ import annotations

from nicegui import ui
from shift_schemas.lifecycle import has_ended
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.change_panel import ChangePanel
from shift_gateway.web.desk_elements import DeskElements
from shift_gateway.web.desk_view import desk_numbers
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import Frame, explain, testid, text
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.live_page import live_session_page
from shift_gateway.web.result_entry import ResultEntry
from shift_gateway.web.scoring_editor import ScoringEditor
from shift_gateway.web.steering import Steering

PAUSE = (
    "While the learner is paused, results are recorded and counted in the cumulative reward, but values and visits "
    "stay as they are (study: learner.paused)."
)

PARTS = (
    ("Decision", "decision"), ("History", "decisions"), ("Values", "learning"), ("Person", "person"),
    ("Scoring table", "scoring"), ("Results", "results"), ("Changes", "change-list"),
)  # fmt: skip
"""The parts of the page, and the anchors that its links lead to."""


def add_desk_page(gateway: Gateway, histories: LiveHistories) -> None:
    """Add the page."""

    @ui.page("/session/{name}/desk")
    async def desk(name: str) -> None:
        Frame(f"Desk of {name}")
        await live_session_page(gateway, histories, name, lambda history: DeskPage(gateway, name, history))


class DeskPage:
    """The elements of one open desk view."""

    def __init__(self, gateway: Gateway, name: str, history: SessionHistory) -> None:
        self._gateway = gateway
        self._name = name
        self._history = history
        self._steering = Steering(gateway, name)
        study = history.study() or Study(study="default")
        self._head()
        with ui.element("main").classes("desk"):
            self._elements = DeskElements(history, self._select)
            self._editor = ScoringEditor(history, self._steering, study)
            with ui.element("div").classes("stack"):
                self._editor.preview_panel()
                self._result = ResultEntry(history, self._steering)
            self._changes = ChangePanel(history, self._steering)

    def _head(self) -> None:
        with ui.element("header").classes("bar").style("padding: 0 1rem .4rem"):
            self._title = text(tag="h1")
            self._ended = text("", "muted")
            ui.element("span").classes("grow")
            self._learner = text("", "", "learner")
            self._pause = testid(ui.button("Pause the learner", on_click=self._toggle).props("outline"), "pause")
            explain(self._pause, PAUSE)
            self._steering.name_field()
            ui.link("Room view", f"/session/{self._name}")
        with ui.element("nav").classes("bar anchors").props('aria-label="Parts of this page"'):
            for label, anchor in PARTS:
                ui.link(label, f"#{anchor}")

    def _select(self, n: int) -> None:
        self._elements.selected = n
        self._result.select(n)

    async def _toggle(self) -> None:
        study = self._history.study()
        if study is not None:
            await self._steering.configure({"learner": {"paused": not study.learner.paused}})

    def update(self) -> str:
        """Show the present; return the JavaScript that the browser runs for tables and charts."""
        now_ns = self._gateway.api.clock.now().ns
        numbers = desk_numbers(self._history, now_ns)
        self._title.text = numbers.title
        self._learner.text = f"{numbers.learner}, paused" if numbers.paused else numbers.learner
        self._pause.text = "Resume the learner" if numbers.paused else "Pause the learner"
        if has_ended(numbers.state) and not self._ended.text:
            self._ended.text = "This session has ended."
            self._pause.disable()
        self._result.update()
        return self._elements.script(now_ns) + self._editor.script() + self._changes.script()
