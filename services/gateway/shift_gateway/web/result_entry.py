"""The form with which a person enters the result of a decision, or corrects it."""

from __future__ import annotations

from nicegui import ui
from shift_schemas.errors import FieldError, MalformedMessage, ShiftError, UnknownThing, shorten
from shift_schemas.messages import Decision, ReportPerformance, Result

from shift_gateway.web.desk_view import reports_in_force
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import explain, show_error, testid, text
from shift_gateway.web.panels import panel
from shift_gateway.web.steering import Steering


class ResultEntry:
    """The form. It offers the newest decision without a result until somebody names another one."""

    def __init__(self, history: SessionHistory, steering: Steering) -> None:
        self._history = history
        self._steering = steering
        self._key: tuple[int, int, str] = (-1, -1, "")
        self._offered = ""
        """The decision that the form offered last; another content of its field was typed."""
        with panel("Enter a result", anchor="results") as heading:
            explain(heading, "The result of a task in both dimensions. It is learned from like a reported one.")
            with ui.element("div").classes("bar"):
                self._decision = ui.input("Decision: its id or number").props("dense outlined").style("width: 15rem")
                testid(self._decision, "result-decision")
                self._note = text("", "muted")
            with ui.element("div").classes("bar"):
                self._comprehension = testid(ui.checkbox("Comprehension: success (theory)"), "result-comprehension")
                self._enabledness = testid(ui.checkbox("Enabledness: success (practice)"), "result-enabledness")
            with ui.element("div").classes("bar"):
                self._duration = _seconds("Time to solve it, s", "result-duration")
                self._second = _seconds("Enabledness: other time, s", "result-duration-enabledness")
                self._button = testid(ui.button("Enter the result", on_click=self._enter).props("outline"), "result")

    def select(self, n: int) -> None:
        """Choose the decision with this number."""
        found = decision_named(self._history, str(n))
        if found is not None:
            self._decision.value = found.decision_id

    def disable(self) -> None:
        """Accept no result any more."""
        self._button.disable()

    def update(self) -> None:
        """Offer the newest decision without a result, and say what is known of the one in the field."""
        history = self._history
        key = (len(history.decisions), len(history.performances), str(self._decision.value or ""))
        if key == self._key:
            return
        if key[:2] != self._key[:2]:  # not while somebody types
            self._offer()
        self._key = (*key[:2], str(self._decision.value or ""))
        self._note.text = decision_note(history, str(self._decision.value or ""))

    def _offer(self) -> None:
        offered = newest_without_result(self._history)
        if self._decision.value in ("", self._offered) and offered:
            self._decision.value = self._offered = offered

    async def _enter(self) -> None:
        try:
            decision = chosen_decision(self._history, str(self._decision.value or "")).decision_id
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
            self._offered = decision
            ui.notify("The result is recorded.", type="positive")


def decision_named(history: SessionHistory, typed: str) -> Decision | None:
    """Return the decision with this id or, if there is none, with this number."""
    name = typed.strip()
    found = {str(d.n): d for d in history.decisions.items} | {d.decision_id: d for d in history.decisions.items}
    return found.get(name)


def chosen_decision(history: SessionHistory, typed: str) -> Decision:
    """Return the decision that somebody named; raise :class:`UnknownThing` if there is none."""
    found = decision_named(history, typed)
    if found is None:
        raise UnknownThing(f"this session has no decision {shorten(typed)}; write the id or the number of a decision")
    return found


def newest_without_result(history: SessionHistory) -> str:
    """Return the id of the newest decision without a result; '' if each has one."""
    reports = reports_in_force(history)
    missing = (d.decision_id for d in reversed(history.decisions.items) if d.decision_id not in reports)
    return next(missing, "")


def decision_note(history: SessionHistory, typed: str) -> str:
    """Return what is known of the decision that somebody named."""
    found = decision_named(history, typed)
    if found is None:
        return "Each decision has its result." if not typed else "There is no such decision."
    report = reports_in_force(history).get(found.decision_id)
    if report is None:
        return f"Decision {found.n}, {found.task}: no result yet."
    return f"Decision {found.n}, {found.task}: reward {report.reward:.2f}. Yours replaces it; both are recorded."


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
