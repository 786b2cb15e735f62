"""What the desk view shows of a session at one time: its numbers, its decisions and the person's awareness. Pure."""

from __future__ import annotations

from typing import NamedTuple

from shift_schemas.messages import Decision, Estimate, Observation, Performance, SessionState
from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json

from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.score_parts import ScoreParts, score_parts
from shift_gateway.web.table_rows import Button, Cell, Row
from shift_gateway.web.wording import clock_time, duration, levels

NOTHING = "–"
"""What is shown for a value that does not exist."""
SELECT = "desk-select"
"""The browser's event for a decision that was selected, with its number."""


class DeskNumbers(NamedTuple):
    """The single values, as text."""

    title: str = ""
    state: SessionState = "live"
    focus_shift: str = NOTHING
    capacity: str = NOTHING
    gaze: str = NOTHING
    epsilon: str = NOTHING
    cumulative_reward: str = "0.00"
    learner: str = ""
    paused: bool = False


def desk_numbers(history: SessionHistory, now_ns: int, at_ns: int = END_OF_TIME) -> DeskNumbers:
    """Return the values of a time; ``now_ns`` is the time against which the session's length is measured, ns."""
    session, study = history.session(at_ns), history.study(at_ns)
    if session is None or study is None:
        return DeskNumbers()
    observation, policy = history.observation(at_ns), history.policies.last(at_ns)
    report, decision = history.performances.last(at_ns), history.decisions.last(at_ns)
    ended = session.ended.ns if session.ended else now_ns
    length = duration((min(now_ns, ended) - session.started.ns) / NS)
    n = decision.n if decision else 0
    epsilon = NOTHING if policy is None else "none" if policy.epsilon is None else f"{policy.epsilon:.2f}"
    return DeskNumbers(
        title=f"{session.participant} · {session.study} · {length} · decision {n}/{study.interactions}",
        state=session.state,
        focus_shift=f"{observation.gaze.focus_shift:.2f}" if observation else NOTHING,
        capacity=f"{observation.capacity.value:.2f} {observation.capacity.category}" if observation else NOTHING,
        gaze=observation.gaze.category if observation else NOTHING,
        epsilon=epsilon,
        cumulative_reward=f"{report.cumulative_reward:z.2f}" if report else "0.00",
        learner=study.learner.name,
        paused=study.learner.paused,
    )


def facts_so_far(history: SessionHistory, at_ns: int = END_OF_TIME) -> tuple[int, ...]:
    """Return the counts of the facts that the tables are made of: they change only with these."""
    series = (
        history.configs, history.decisions, history.performances, history.policies, history.estimates,
        history.overrides, history.markers, history.sessions,
    )  # fmt: skip
    return tuple(found.count(at_ns) for found in series)


# --- decisions ---


def selected_decision(history: SessionHistory, n: int | None, at_ns: int = END_OF_TIME) -> Decision | None:
    """Return the decision with this number; the last one if there is none, or if none is selected."""
    found = next((d for d in history.decisions.until(at_ns) if d.n == n), None) if n is not None else None
    return found or history.decisions.last(at_ns)


def reports_in_force(history: SessionHistory, at_ns: int = END_OF_TIME) -> dict[str, Performance]:
    """Return the report of each reported decision, by the decision's id: a correction replaces the first one."""
    return {p.decision_id: p for p in history.performances.until(at_ns)}


RowCache = dict[tuple[int, int, bool], Row]
"""Rows by number of the decision, number of its report (0: none), and whether it is selected."""


def decision_rows(
    history: SessionHistory, selected: int | None, at_ns: int = END_OF_TIME, known: RowCache | None = None
) -> list[Row]:
    """Return a row for each decision, the newest first; rows in ``known`` are not made again."""
    reports = reports_in_force(history, at_ns)
    cache: RowCache = {} if known is None else known
    rows = []
    for decision in reversed(history.decisions.until(at_ns)):
        report = reports.get(decision.decision_id)
        key = (decision.n, report.n if report else 0, decision.n == selected)
        if key not in cache:
            cache[key] = _decision_row(decision, report, decision.n == selected)
        rows.append(cache[key])
    return rows


def _decision_row(decision: Decision, report: Performance | None, selected: bool) -> Row:
    seen = decision.observation
    propensity = NOTHING if decision.propensity is None else f"{decision.propensity:.2f}"
    reward = NOTHING if report is None else f"{report.reward:.2f}" + (" (corrected)" if report.corrects else "")
    triple = f"{seen.capacity}/{seen.gaze}/{seen.awareness}"
    select = Button(str(decision.n), SELECT, decision.n, f"Show decision {decision.n}")
    cells: list[Cell | str] = [
        Cell(button=select), Cell(clock_time(decision.stamp.ns), small=decision.decision_id), decision.task, triple,
        decision.cognitive_state, levels(decision.strategy), propensity, decision.policy_source, reward,
        truth(decision.explored), truth(decision.stale),
    ]  # fmt: skip
    return Row(cells, f"decision-{decision.n}", "selected" if selected else "")


def truth(value: bool) -> str:
    """Return a truth value as the wire has it."""
    return "true" if value else "false"


def parts_of(history: SessionHistory, decision: Decision | None) -> tuple[ScoreParts, ...]:
    """Return how the scoring table led to a decision's scores, by the configuration that the decision was made with."""
    if decision is None:
        return ()
    version = decision.versions.config
    config = next((c for c in reversed(history.configs.items) if c.version == version), None)
    if config is None:
        return ()
    return score_parts(study_from_json(config.study).scoring, decision.observation, decision.strategy)


def score_rows(parts: tuple[ScoreParts, ...]) -> list[Row]:
    """Return a row for each strategy: three entries, their sum, the score, and the level that follows."""
    return [
        Row([
            part.strategy, *(Cell(f"{value:g}", small=word) for _, word, value in part.entries), f"{part.total:g}",
            f"{part.weight:g}", Cell(f"{part.score:.2f}", small=f"{part.weight:g} × {part.total:g} / {part.s_max:g}"),
            ", ".join(f"{t:.2f}" for t in part.thresholds), part.suggested, part.chosen or NOTHING,
        ])
        for part in parts
    ]  # fmt: skip


def scores_text(decision: Decision | Estimate | None) -> str:
    """Return the scores of a decision or estimate, such as ``negation 0.33, hesitation 0.67``."""
    if decision is None:
        return NOTHING
    return ", ".join(f"{name} {score:.2f}" for name, score in decision.scores.items())


def probability_rows(decision: Decision | None) -> list[Row]:
    """Return a row for each action: its probability, and whether it was suggested and chosen."""
    if decision is None:
        return [Row(["no decision yet", "", ""])]
    marks = ((decision.strategy, "chosen"), (decision.suggested, "suggested by the scoring table"))
    return [
        Row([levels(action), f"{p:.2f}", ", ".join(word for a, word in marks if a == action)])
        for action, p in zip(decision.actions, decision.probabilities, strict=True)
    ]


# --- the person ---


def awareness_rows(observation: Observation | None) -> list[Row]:
    """Return a row for each task that has results: its class, and the success ratios of both dimensions."""
    if observation is None or not observation.awareness:
        return [Row(["no results yet", "", "", "", ""])]
    return [
        Row(
            [
                task, seen.category, Cell(f"{seen.comprehension:.2f}", bar=seen.comprehension),
                Cell(f"{seen.enabledness:.2f}", bar=seen.enabledness), str(seen.results),
            ],
            f"awareness-{task}",
        )
        for task, seen in observation.awareness.items()
    ]  # fmt: skip


def reward_points(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[tuple[int, float]]:
    """Return the cumulative reward after each report, by the report's number."""
    return [(p.n, round(p.cumulative_reward, 4)) for p in history.performances.until(at_ns)]
