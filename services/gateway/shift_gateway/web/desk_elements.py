"""The panels of the desk view that show the learning. A recording shows the same panels at the time of its cursor."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from nicegui import ui
from shift_schemas.messages import Decision

from shift_gateway.web.clock_rows import HEADINGS as CLOCKS
from shift_gateway.web.clock_rows import clock_rows
from shift_gateway.web.data_table import DataTable
from shift_gateway.web.desk_charts import probability_options, probability_update, reward_options, reward_update
from shift_gateway.web.desk_view import (
    DeskNumbers,
    RowCache,
    awareness_rows,
    decision_rows,
    desk_numbers,
    facts_so_far,
    parts_of,
    probability_rows,
    reward_points,
    score_rows,
    scores_text,
    selected_decision,
    truth,
)
from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.layout import explain, text
from shift_gateway.web.panels import panel
from shift_gateway.web.table_rows import Heading
from shift_gateway.web.value_table import value_headings, value_rows, value_scale

HISTORY = (
    Heading("n", "The decision's number. Press it to see how the decision came about."), "time", "task",
    Heading("triple", "Capacity, gaze and awareness class: one of 30 monitoring states (paper, section III-A)."),
    Heading("cognitive state", "The state that the scoring table reduces the triple to (paper, section III-C)."),
    Heading("strategy", "One level of each scaffolding strategy (paper, section III-B)."),
    Heading("propensity", "The probability with which the strategy was drawn; an override has none."),
    Heading("source", "Where the probabilities came from: learner, last_policy, scoring or override."),
    Heading("reward", "From success and duration of both dimensions (paper, section III-D)."),
    Heading("explored", "Whether it is not the action with the largest probability."),
    Heading("stale", "Whether the observation had not yet seen all data that it should have seen."),
)  # fmt: skip
SCORES = (
    "strategy", "capacity", "gaze", "awareness", "sum", "weight", Heading("score", "Weight × sum / S_max."),
    Heading("thresholds", "The score from which each further level holds."), "suggested level", "level used",
)  # fmt: skip
AWARENESS = (
    "task", Heading("class", "Task awareness (paper, section III-A3)."),
    Heading("comprehension", "Share of successes in theory, over the study's window of results."),
    Heading("enabledness", "Share of successes in practice, over the study's window of results."), "results",
)  # fmt: skip
NUMBERS = {
    "focus-shift": ("focus shift", "From 0 to 1: rises when the held target changes (paper, section III-A2)."),
    "desk-gaze": ("gaze", "The gaze class: distracted, uncertain or focused (paper, section III-A2)."),
    "desk-capacity": ("capacity", "Processing capacity and its class (paper, section III-A1)."),
    "epsilon": ("epsilon", "The probability of exploring in the next decision, if the learner has one."),
    "cumulative-reward": ("cumulative reward", "The sum of the rewards so far (paper, section III-D)."),
}


class DeskElements:
    """The panels; ``selected`` is the number of the decision that is explained, None the last one.

    Parameters
    ----------
    on_select
        Is called with the number of the decision that somebody selects.
    """

    def __init__(self, history: SessionHistory, on_select: Callable[[int], None]) -> None:
        self._history = history
        self.selected: int | None = None
        self._key: tuple[Any, ...] = ()
        self._rows: RowCache = {}
        self._numbers = DeskNumbers()
        self._texts: dict[str, ui.label] = {}
        self._numbers_panel()
        self._decision_panel()
        self._history_panel(on_select)
        self._values_panel()
        self._person_panels()

    # --- the elements ---

    def _numbers_panel(self) -> None:
        section = ui.element("section").classes("panel wide live").props('aria-label="Numbers"')
        with section, ui.element("div").classes("numbers"):
            for name, (label, explanation) in NUMBERS.items():
                with ui.element("div") as box:
                    explain(box, explanation)
                    text(f"{label} ", "caption", tag="span")
                    self._texts[name] = text("–", "value", name, tag="span")

    def _decision_panel(self) -> None:
        with panel("How the decision came about", wide=True, anchor="decision") as heading:
            self._decision_heading = heading
            explain(heading, "Table I gives each observation's entry; the sum is weighted (paper, section III-C).")
            with ui.element("div").classes("numbers"):
                for name, label in (("scores", "scores"), ("explored", "explored")):
                    with ui.element("div"):
                        text(f"{label} ", "caption", tag="span")
                        self._texts[name] = text("–", "", name, tag="span")
                self._note = text("", "muted")
            self._scores = DataTable("score-parts", "How the scores were calculated", SCORES)
            with ui.element("div").classes("two"):
                self._probability_chart = ui.echart(probability_options())
                self._probabilities = DataTable(
                    "probabilities", "Probability of each action", ("action", "probability", "this decision")
                )

    def _history_panel(self, on_select: Callable[[int], None]) -> None:
        with panel("History of decisions", wide=True, anchor="decisions") as heading:
            explain(heading, "Every decision of the session, the newest first. “–”: it does not exist.")
            self._decisions = DataTable("history", "History of decisions", HISTORY, scrolls=True)
        ui.on("desk-select", lambda event: _selected(event.args, on_select))

    def _values_panel(self) -> None:
        with panel("Values", wide=True, anchor="learning") as heading:
            explain(heading, "What the learner expects of each action in each state, and how often it was reported.")
            text("Stronger colour: larger value. Frame: largest probability. n: reported decisions.", "caption")
            with ui.element("div").classes("two heat-tables"):
                with ui.element("div"):
                    text("Now", tag="h3")
                    self._values = DataTable("values", "Values now")
                with ui.element("div"):
                    text("Prior: the session's first policy", tag="h3")
                    self._prior = DataTable("prior", "Values of the prior")

    def _person_panels(self) -> None:
        with panel("Awareness of each task", anchor="person") as heading:
            explain(heading, "Comprehension (in theory) and enabledness (in practice); paper, section III-A3.")
            self._awareness = DataTable("awareness", "Awareness of each task", AWARENESS)
        with panel("Cumulative reward") as heading:
            explain(heading, "The sum of the rewards after each report; the number is at the top of the page.")
            self._reward_chart = ui.echart(reward_options())
        with panel("Clocks of the gaze sources", wide=True, anchor="clocks") as heading:
            explain(heading, "What came of each source and what did not, and how its clock runs; every ten seconds.")
            self._clocks = DataTable("clocks", "Clocks of the gaze sources", CLOCKS)

    # --- what changes ---

    def script(self, now_ns: int, at_ns: int = END_OF_TIME) -> str:
        """Show a time; return the JavaScript that the browser runs for tables and charts."""
        history = self._history
        numbers = desk_numbers(history, now_ns, at_ns)
        if numbers != self._numbers:
            self._numbers = numbers
            self._show_numbers(numbers)
        person = self._awareness.script(awareness_rows(history.observation(at_ns)))
        person += self._clocks.script(clock_rows(history.ledgers(at_ns)))
        key = (self.selected, *facts_so_far(history, at_ns))
        if key == self._key:
            return person
        self._key = key
        decision = selected_decision(history, self.selected, at_ns)
        return person + self._decision_script(decision, at_ns) + self._learning_script(at_ns)

    def _show_numbers(self, numbers: DeskNumbers) -> None:
        values = {
            "focus-shift": numbers.focus_shift, "desk-gaze": numbers.gaze, "desk-capacity": numbers.capacity,
            "epsilon": numbers.epsilon, "cumulative-reward": numbers.cumulative_reward,
        }  # fmt: skip
        for name, value in values.items():
            self._texts[name].text = value

    def _decision_script(self, decision: Decision | None, at_ns: int) -> str:
        n = decision.n if decision else None
        which = f"decision {n}, {decision.task}" if decision else "no decision yet"
        self._decision_heading.text = f"How the decision came about: {which}"
        self._texts["scores"].text = scores_text(decision or self._history.estimates.last(at_ns))
        self._texts["explored"].text = truth(decision.explored) if decision else "–"
        overridden = decision is not None and decision.policy_source == "override"
        self._note.text = "An override chose the strategy; the probabilities were not used." if overridden else ""
        bars = probability_update(decision)
        return (
            self._scores.script(score_rows(parts_of(self._history, decision)))
            + self._probabilities.script(probability_rows(decision))
            + self._decisions.script(decision_rows(self._history, n, at_ns, self._rows))
            + (_chart_script(self._probability_chart, bars) if bars else "")
        )

    def _learning_script(self, at_ns: int) -> str:
        policies = self._history.policies
        now, first = policies.last(at_ns), policies.items[0] if policies.items else None
        scale = value_scale((now, first))
        return (
            self._values.script(value_rows(now, scale), value_headings(now))
            + self._prior.script(value_rows(first, scale), value_headings(first))
            + _chart_script(self._reward_chart, reward_update(reward_points(self._history, at_ns)))
        )


def _chart_script(chart: ui.echart, update: dict[str, Any]) -> str:
    return f"shift.chart({chart.id}, {json.dumps(update)});"


def _selected(given: Any, on_select: Callable[[int], None]) -> None:
    if isinstance(given, int):
        on_select(given)
