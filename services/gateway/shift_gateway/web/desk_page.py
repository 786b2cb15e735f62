"""The desk view at ``/session/NAME/desk``: everything of a running session, and its steering."""

from __future__ import annotations

from nicegui import ui
from shift_schemas.messages import Decision, Policy
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.charts import bar_options, curve_options, heat_options
from shift_gateway.web.desk_view import (
    awareness_texts,
    contributions,
    heat_map,
    history_rows,
    number,
    probabilities,
    reward_curve,
    scores_text,
    value_rows,
    words,
)
from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.layout import Frame, explain, redraw, testid, text
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.live_page import live_session_page
from shift_gateway.web.steering_page import SteeringPanel
from shift_gateway.web.wording import levels, reasons

HISTORY_COLUMNS = {
    "n": "number of the decision", "time": "time of this machine", "task": "task",
    "observation": "capacity / gaze / awareness", "state": "cognitive state", "strategy": "strategy that was used",
    "source": "learner, last_policy, scoring or override", "p": "probability of the strategy in its policy",
    "explored": "whether it was not the best known one", "stale": "whether its observation was old",
    "reward": "reward, -1 to 1", "decision_id": "id",
}  # fmt: skip


def add_desk_page(gateway: Gateway, histories: LiveHistories) -> None:
    """Add the page."""

    @ui.page("/session/{name}/desk")
    async def desk(name: str) -> None:
        Frame(f"Desk of {name}")
        await live_session_page(gateway, histories, name, lambda history: DeskPage(gateway, name, history))


class DeskPage:
    """The elements of one open desk view: what is shown, and beside it the steering."""

    def __init__(self, gateway: Gateway, name: str, history: SessionHistory) -> None:
        self._history = history
        self._revision = -1
        with ui.element("div").classes("page"):
            with ui.element("div").classes("bar"):
                text(f"Desk of session {name}", tag="h1")
                ui.element("span").classes("grow")
                ui.link("Room view", f"/session/{name}")
            self._panels = DeskPanels(history)
            self._steering = SteeringPanel(gateway, name, history)

    def update(self) -> str:
        """Show what changed; return the JavaScript that the browser runs."""
        self._panels.show_person()
        if self._history.revision == self._revision:
            return ""
        self._revision = self._history.revision
        self._panels.show()
        self._steering.show()
        return ""


class DeskPanels:
    """The person, the last decision, the history and the learning of a session, live or recorded."""

    def __init__(self, history: SessionHistory) -> None:
        self._history = history
        self._texts: dict[str, ui.label] = {}
        self._drawn: Policy | None = None
        study = history.study() or Study(study="default")
        self._actions = [levels(action) for action in study.scoring.choices]
        with ui.element("div").classes("columns even"):
            self._person()
            self._decision()
        self._history_table()
        self._learning(study)

    # --- the elements ---

    def _person(self) -> None:
        with ui.element("section").classes("panel live"):
            text("The person", tag="h2")
            self._labelled(
                "focus shift", "focus-shift", "How often gaze moves between AOIs, 0 to 1 (paper, section III-A2)."
            )
            self._state = text()
            text("Awareness of each task with results (paper, section III-A3)", "caption")
            self._awareness = ui.element("div")
            self._tasks: dict[str, ui.label] = {}

    def _decision(self) -> None:
        with ui.element("section").classes("panel live"):
            text("The last decision", tag="h2")
            self._title = text()
            self._labelled("scores", "scores", "The scaffolding score of each strategy, 0 to 1 (paper, section III-C).")
            self._contributions = ui.element("div").classes("muted")
            self._labelled(
                "explored", "explored", "Whether the strategy is not the best known one (paper, section III-D)."
            )
            text("Probability of each strategy", "caption")
            self._texts["probabilities"] = text("", "", "probabilities")
            self._bars = ui.echart(bar_options(self._actions)).classes("chart")

    def _history_table(self) -> None:
        columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in HISTORY_COLUMNS]
        with ui.element("section").classes("panel live"):
            text("Decisions", tag="h2")
            self._decisions = ui.table(columns=columns, rows=[], row_key="decision_id", pagination=10)
            testid(self._decisions.props("flat dense").classes("sessions"), "history")
            for name, meaning in HISTORY_COLUMNS.items():
                slot = f'<q-th :props="props">{name}<q-tooltip>{meaning}</q-tooltip></q-th>'
                self._decisions.add_slot(f"header-cell-{name}", slot)

    def _learning(self, study: Study) -> None:
        with ui.element("section").classes("panel live"):
            text("What is learned", tag="h2")
            with ui.element("div").classes("bar"):
                self._labelled("epsilon", "epsilon", "Probability of exploring; it falls to 0 (paper, section III-D).")
                self._labelled(
                    "cumulative reward", "cumulative-reward", "Sum of all rewards; a correction replaces its reward."
                )
            with ui.element("div").classes("columns even"):
                with ui.element("div"):
                    text("Values now", "caption")
                    self._heat = ui.echart(heat_options(self._actions, [], [])).classes("chart tall")
                with ui.element("div"):
                    text("Values at the start (the prior)", "caption")
                    self._prior = ui.echart(heat_options(self._actions, [], [])).classes("chart tall")
            with ui.expansion("The same values as a table: value (visits)", value=True).classes("more"):
                names = ["state", *self._actions]
                columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in names]
                self._values = ui.table(columns=columns, rows=[], row_key="state").props("flat dense")
                testid(self._values.classes("sessions"), "values")
            text("Cumulative reward over the reports", "caption")
            self._curve = ui.echart(curve_options("reward")).classes("chart")

    def _labelled(self, caption: str, name: str, tooltip: str) -> None:
        with ui.element("div") as line:
            text(f"{caption}: ", "muted", tag="span")
            self._texts[name] = text("", "", name, "span")
        explain(line, tooltip)

    # --- what changes ---

    def show_person(self, at_ns: int = END_OF_TIME) -> None:
        """Show the person at a time."""
        observation = self._history.observation(at_ns)
        self._texts["focus-shift"].text = number(observation.gaze.focus_shift if observation else None, 2)
        if observation is not None:
            capacity, gaze = observation.capacity, observation.gaze
            looked = ", ".join(f"{aoi} {weight:.2f}" for aoi, weight in gaze.weights.items())
            self._state.text = (
                f"capacity {capacity.value:.2f} ({capacity.category}), gaze {gaze.category}, attention {looked}"
            )
        for task, words_ in awareness_texts(self._history, at_ns).items():
            if task not in self._tasks:
                with self._awareness, ui.element("div"):
                    text(f"{task}: ", "muted", tag="span")
                    self._tasks[task] = text("", "", f"awareness-{task}", "span")
            self._tasks[task].text = words_

    def show(self, at_ns: int = END_OF_TIME) -> None:
        """Show the decisions and what is learned at a time."""
        self._decisions.rows[:] = history_rows(self._history, at_ns)
        self._decisions.update()
        decision, study = self._history.decisions.last(at_ns), self._history.study(at_ns)
        if decision is not None and study is not None:
            self._show_decision(decision, study)
        policy = self._history.policies.last(at_ns)
        if policy is not None and policy is not self._drawn:
            self._show_policy(policy)
        redraw(self._curve, {"series": [{"data": reward_curve(self._history, at_ns)}]})

    def _show_decision(self, decision: Decision, study: Study) -> None:
        self._title.text = (
            f"Decision {decision.n}, task {decision.task}: {levels(decision.strategy)} ({decision.policy_source}), "
            f"because of {reasons(decision.observation)}"
        )
        self._texts["scores"].text = scores_text(decision.scores)
        self._texts["explored"].text = words(decision.explored)
        self._contributions.clear()
        with self._contributions:
            for contribution in contributions(study, decision):
                text(contribution.text)
        chances = probabilities(decision.actions, decision.probabilities)
        self._texts["probabilities"].text = "; ".join(f"{name}: {p:.3f}" for name, p in chances)
        redraw(self._bars, {"series": [{"data": [round(p, 3) for _, p in chances]}]})

    def _show_policy(self, policy: Policy) -> None:
        self._drawn = policy
        self._texts["epsilon"].text = number(policy.epsilon)
        self._texts["cumulative-reward"].text = number(policy.cumulative_reward)
        self._values.rows[:] = value_rows(policy)
        self._values.update()
        first = self._history.policies.items[0]
        for chart, shown in ((self._heat, policy), (self._prior, first)):
            axis = {"yAxis": {"data": list(shown.states)}, "series": [{"data": heat_map(shown)}]}
            redraw(chart, axis)
