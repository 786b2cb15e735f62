"""What the desk shows of a session: the decisions, how each came about, what was learned, and the changes. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.messages import Config, Decision, Policy
from shift_study.patching import merge_patch_between
from shift_study.scoring import reduce
from shift_study.study import Study

from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.wording import clock_time, levels


def history_rows(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[dict[str, Any]]:
    """Return one row for each decision, the newest first."""
    reports = {p.decision_id: p for p in history.performances.until(at_ns)}
    rows = []
    for decision in reversed(history.decisions.until(at_ns)):
        report, seen = reports.get(decision.decision_id), decision.observation
        rows.append(
            {
                "n": decision.n, "time": clock_time(decision.stamp.ns), "task": decision.task,
                "observation": f"{seen.capacity} / {seen.gaze} / {seen.awareness}",
                "state": decision.cognitive_state, "strategy": levels(decision.strategy),
                "source": decision.policy_source, "p": number(decision.propensity, 2),
                "explored": words(decision.explored), "stale": words(decision.stale),
                "reward": number(report.reward if report else None), "decision_id": decision.decision_id,
            }
        )  # fmt: skip
    return rows


def number(value: float | None, digits: int = 3) -> str:
    """Return a number as text; a missing one is a dash."""
    return "–" if value is None else f"{value:.{digits}f}"


def words(value: bool) -> str:
    """Return a truth value as messages write it."""
    return "true" if value else "false"


class Contribution(NamedTuple):
    """How one strategy's score and level follow from the scoring table (paper, section III-C)."""

    strategy: str
    entries: tuple[float, float, float]
    """The table's entries for the observed capacity, gaze and awareness."""
    weight: float
    score: float
    thresholds: tuple[float, ...]
    level: str
    """The level that the scoring system suggests."""

    @property
    def text(self) -> str:
        """The computation in one line."""
        capacity, gaze, awareness = (f"{entry:g}" for entry in self.entries)
        limits = ", ".join(f"{t:.2f}" for t in self.thresholds)
        return (
            f"{self.strategy}: capacity {capacity} + gaze {gaze} + awareness {awareness}, weight {self.weight:g}, "
            f"score {self.score:.3f}; thresholds {limits}; suggests {self.level}"
        )


def contributions(study: Study, decision: Decision) -> list[Contribution]:
    """Return how the scores of a decision follow from the study's table."""
    seen = decision.observation
    rows = study.scoring.table.rows(Triple(seen.capacity, seen.gaze, seen.awareness))
    return [
        Contribution(
            name, (rows[0][name], rows[1][name], rows[2][name]), strategy.weight, decision.scores[name],
            tuple(strategy.thresholds), decision.suggested[name],
        )
        for name, strategy in study.scoring.strategies.items()
    ]  # fmt: skip


def scores_text(scores: Mapping[str, float]) -> str:
    """Return the scores in one line."""
    return ", ".join(f"{name} {score:.3f}" for name, score in scores.items())


def probabilities(actions: Sequence[Mapping[str, str]], row: Sequence[float]) -> list[tuple[str, float]]:
    """Return each action with its probability."""
    return [(levels(action), p) for action, p in zip(actions, row, strict=True)]


def value_rows(policy: Policy) -> list[dict[str, str]]:
    """Return a row for each state of the policy: value and visits of each action, as ``0.250 (3)``."""
    names = [levels(action) for action in policy.actions]
    return [
        {"state": state, **{n: f"{v:.3f} ({c})" for n, v, c in zip(names, row.values, row.visits, strict=True)}}
        for state, row in policy.states.items()
    ]


def heat_map(policy: Policy) -> list[list[Any]]:
    """Return the cells of the heat map: action's index, state's index, value."""
    return [
        [action, state, round(value, 3)]
        for state, row in enumerate(policy.states.values())
        for action, value in enumerate(row.values)
    ]


def awareness_texts(history: SessionHistory, at_ns: int = END_OF_TIME) -> dict[str, str]:
    """Return the awareness of each task that has results, in its two dimensions."""
    observation = history.observation(at_ns)
    if observation is None:
        return {}
    return {
        task: f"{a.category}, comprehension {a.comprehension:.2f}, enabledness {a.enabledness:.2f}, "
        f"{a.results} result{'' if a.results == 1 else 's'}"
        for task, a in observation.awareness.items()
    }


def reward_curve(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[list[float]]:
    """Return the cumulative reward after each report: its number and the sum."""
    return [[p.n, round(p.cumulative_reward, 4)] for p in history.performances.until(at_ns)]


# --- changes of the configuration ---


class Change(NamedTuple):
    """One configuration, compared with the one before it."""

    version: int
    time: str
    author: str
    differences: tuple[tuple[str, str, str], ...]
    """Path, old value and new value."""
    undo: dict[str, Any]
    """The merge patch that takes the change back."""

    @property
    def text(self) -> str:
        """The change in one line."""
        who = self.author or "name not given"
        what = "; ".join(f"{path}: {old} → {new}" for path, old, new in self.differences) or "nothing differs"
        return f"{self.version} at {self.time}, {who}: {what}"


def changes(configs: Sequence[Config]) -> list[Change]:
    """Return every change after the start, the newest first."""
    found = []
    for before, after in pairwise(configs):
        old, new = json.loads(before.study), json.loads(after.study)
        found.append(
            Change(
                after.version, clock_time(after.stamp.ns), after.author, tuple(differences(old, new)),
                merge_patch_between(new, old),
            )
        )  # fmt: skip
    return found[::-1]


def differences(old: Any, new: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield the path, the old and the new value of each difference between two studies as plain objects."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in {**old, **new}:
            if old.get(key) != new.get(key):
                yield from differences(old.get(key), new.get(key), f"{path}.{key}" if path else key)
    else:
        yield path, json.dumps(old), json.dumps(new)


class StateChange(NamedTuple):
    """A triple whose cognitive state would be another one."""

    triple: Triple
    before: str
    after: str

    @property
    def text(self) -> str:
        """The change in one line."""
        return f"{self.triple.name}: {self.before} → {self.after}"


def state_changes(before: Study, after: Study) -> list[StateChange]:
    """Return the triples whose cognitive state differs between two studies."""
    pairs = ((t, reduce(before.scoring, t).cognitive_state, reduce(after.scoring, t).cognitive_state) for t in TRIPLES)
    return [StateChange(*pair) for pair in pairs if pair[1] != pair[2]]
