"""The form with which a person enters the result of a decision, or corrects it."""

from __future__ import annotations

from nicegui import ui
from shift_schemas.errors import FieldError, MalformedMessage, ShiftError
from shift_schemas.messages import ReportPerformance, Result

from shift_gateway.web.desk_view import reports_in_force
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import explain, show_error, testid, text
from shift_gateway.web.panels import panel
from shift_gateway.web.steering import Steering

MOST_DECISIONS = 200
"""The form offers the newest decisions only."""


class ResultEntry:
    """The form. It offers the newest decision until another one is chosen."""

    def __init__(self, history: SessionHistory, steering: Steering) -> None:
        self._history = history
        self._steering = steering
        self._key = (-1, -1)
        self._chosen = False
        with panel("Enter a result", anchor="results") as heading:
            explain(heading, "The result of a task in both dimensions. It is learned from like a reported one.")
            with ui.element("div").classes("bar"):
                self._decision = ui.select({}, label="Decision", on_change=self._choose)
                self._decision.props("dense outlined options-dense").style("min-width: 15rem")
                testid(self._decision, "result-decision")
            with ui.element("div").classes("bar"):
                self._comprehension = testid(ui.checkbox("Comprehension: success (theory)"), "result-comprehension")
                self._enabledness = testid(ui.checkbox("Enabledness: success (practice)"), "result-enabledness")
            with ui.element("div").classes("bar"):
                self._duration = _seconds("Time to solve it, s", "result-duration")
                self._second = _seconds("Enabledness: other time, s", "result-duration-enabledness")
                testid(ui.button("Enter the result", on_click=self._enter).props("outline"), "result")
            self._note = text("", "muted")

    def select(self, n: int) -> None:
        """Choose the decision with this number."""
        found = next((d for d in self._history.decisions.items if d.n == n), None)
        if found is not None and found.decision_id in (self._decision.options or {}):
            self._chosen = True
            self._decision.value = found.decision_id

    def update(self) -> None:
        """Offer the newest decisions."""
        key = (len(self._history.decisions), len(self._history.performances))
        if key == self._key:
            return
        self._key = key
        reports = reports_in_force(self._history)
        newest = self._history.decisions.items[-MOST_DECISIONS:][::-1]
        options = {
            d.decision_id: f"{d.n} · {d.task} · "
            + (f"reward {reports[d.decision_id].reward:.2f}" if d.decision_id in reports else "no result")
            for d in newest
        }
        value = self._decision.value if self._chosen and self._decision.value in options else next(iter(options), None)
        chosen = self._chosen
        self._decision.set_options(options, value=value)
        self._chosen = chosen
        self._show_note()

    def _choose(self) -> None:
        self._chosen = self._decision.value != next(iter(self._decision.options or {}), None)
        self._show_note()

    def _show_note(self) -> None:
        has = self._decision.value in reports_in_force(self._history)
        self._note.text = "This decision has a result; yours replaces it. Both are recorded." if has else ""

    async def _enter(self) -> None:
        decision = self._decision.value
        if decision is None:
            ui.notify("There is no decision yet.", type="warning")
            return
        try:
            first = _number(self._duration)
            second = _number(self._second) if str(self._second.value or "").strip() else first
        except ShiftError as e:
            show_error(e)
            return
        done = await self._steering.send(
            ReportPerformance, decision_id=decision, corrects=decision in reports_in_force(self._history),
            comprehension=Result(success=bool(self._comprehension.value), duration_s=first),
            enabledness=Result(success=bool(self._enabledness.value), duration_s=second),
        )  # fmt: skip
        if done:
            self._chosen = False
            ui.notify("The result is recorded.", type="positive")


def _seconds(label: str, name: str) -> ui.input:
    box = ui.input(label).props('dense outlined inputmode="decimal"').style("width: 15rem")
    return testid(box, name)


def _number(box: ui.input) -> float:
    """Return a duration in seconds; raise :class:`MalformedMessage` for anything else."""
    typed = str(box.value or "").strip()
    try:
        value = float(typed)
        if 0 <= value <= 1e6:
            return value
    except ValueError:
        pass
    rule = "write seconds, from 0 to 1000000, such as 5.5"
    raise MalformedMessage(f"duration: {rule}", (FieldError(field="duration", value=typed[:40], rule=rule),))
