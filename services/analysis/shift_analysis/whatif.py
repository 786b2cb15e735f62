"""What would have been decided under another study or learner, and what would it have been worth?

Each recording is verified while it is decided again, and one with a difference is left out and reported.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, get_args

import numpy as np
from shift_model.vocabulary import LearnerName
from shift_recording.export.sources import first_session
from shift_recording.parallel import for_each
from shift_schemas.errors import InvalidStudy, MalformedMessage, ShiftError
from shift_schemas.suggestions import did_you_mean
from shift_study.loading import patched, study_from_json, study_in_force, study_json
from shift_study.scoring_table import strategy_name
from shift_study.study import Study
from shift_verify.verify import verify

from shift_analysis.counterfactual import Alternative, DecidedAgain, Redecider
from shift_analysis.off_policy import (
    PARTICIPANTS,
    Estimate,
    LoggedDecisions,
    estimate_values,
    is_over_participants,
    logged_value,
)

FEW = 30
"""Chosen: below this effective sample size the intervals are not to be relied on."""
LARGE_WEIGHT = 0.1
"""Chosen: a single decision with more than this share of all weights decides the estimate."""


@dataclass(frozen=True)
class OtherPolicy:
    """The policy to compare with: another study, another learner, or both. Without both it is the recorded one.

    ``study`` is a study as JSON, as ``study_json`` writes it, with its conditions; the condition of each session holds.
    """

    study: str = ""
    learner: str = ""

    def __post_init__(self) -> None:
        """Raise :class:`MalformedMessage` if there is no such learner."""
        names = get_args(LearnerName)
        if self.learner and self.learner not in names:
            meant = did_you_mean(self.learner, names)
            raise MalformedMessage(f"there is no learner {self.learner!r}; there are {', '.join(names)}{meant}")

    def alternative(self, condition: str | None) -> Alternative:
        """Return what is different in a session of this condition."""
        return Alternative(study_of=lru_cache(partial(self._study_of, condition=condition)))

    def _study_of(self, recorded: str, condition: str | None) -> str:
        before = study_from_json(recorded)
        after = self._given(condition) if self.study else before
        if self.learner:
            after = patched(after, {"learner": {"name": self.learner}})
        if _levels(before) != _levels(after):
            raise InvalidStudy(
                f"the study {after.study} has other strategies than the recording: {_described(after)} instead of "
                f"{_described(before)}; what-if compares policies over the same strategies"
            )
        return study_json(after)

    def _given(self, condition: str | None) -> Study:
        study = study_from_json(self.study)
        return study_in_force(study, condition if condition in study.conditions else None)


def _levels(study: Study) -> dict[str, list[str]]:
    return {name: list(settings.levels) for name, settings in study.scoring.strategies.items()}


def _described(study: Study) -> str:
    return "; ".join(f"{name}: {', '.join(levels)}" for name, levels in _levels(study).items())


@dataclass(frozen=True)
class ComparedDecision:
    """One decision as it was recorded and under the other policy. Probabilities are in the order of the recording."""

    decision_id: str
    n: int
    task: str
    source: str
    state: str
    """The cognitive state that was recorded."""
    other_state: str
    action: int
    """The number of the strategy that was used."""
    own: int
    """The number of the strategy that SHIFT chose; another than ``action`` only where a person overrode it."""
    other_action: int
    propensity: float | None
    reward: float | None
    probabilities: tuple[float, ...]
    other_probabilities: tuple[float, ...]

    @property
    def differs(self) -> bool:
        """Whether the other policy would have used another strategy, with the same random number."""
        return self.action != self.other_action

    @property
    def is_supported(self) -> bool:
        """Whether everything that the other policy could have chosen had a probability above 0."""
        pairs = zip(self.probabilities, self.other_probabilities, strict=True)
        return self.propensity is not None and all(logged > 0 for logged, other in pairs if other > 0)


@dataclass(frozen=True)
class ComparedRecording:
    """The decisions of one recording, or why there are none."""

    file: str
    session: str = ""
    participant: str = ""
    decisions: tuple[ComparedDecision, ...] = ()
    actions: tuple[str, ...] = ()
    changes: int = 0
    """How often the study was changed while the session ran."""
    problem: str = ""


def compare_recording(path: Path, policy: OtherPolicy) -> ComparedRecording:
    """Decide one recording again. A recording that cannot be decided again has a ``problem``."""
    try:
        session = first_session(path)
        if session is None:
            return ComparedRecording(path.name, problem="it does not hold the session's start")
        redecider = Redecider([policy.alternative(session.condition)])
        report = verify(path, observers=redecider.observers)
        if report.difference is not None:
            return ComparedRecording(path.name, problem=f"it does not verify: {report.difference.sentence}")
        found = redecider.decisions(0)
        changes = redecider.changes
    except ShiftError as e:
        return ComparedRecording(path.name, problem=e.detail)
    actions = tuple(strategy_name(a) for a in found[0].logged.actions) if found else ()
    compared = tuple(_compared(each) for each in found)
    return ComparedRecording(path.name, session.session, session.participant, compared, actions, changes)


def _compared(each: DecidedAgain) -> ComparedDecision:
    logged, other = each.logged, each.other
    where = [other.actions.index(action) for action in logged.actions]
    return ComparedDecision(
        decision_id=logged.decision_id, n=logged.n, task=logged.task, source=logged.policy_source,
        state=logged.cognitive_state, other_state=other.cognitive_state,
        action=logged.actions.index(logged.strategy), own=logged.actions.index(each.own),
        other_action=logged.actions.index(other.strategy), propensity=logged.propensity, reward=each.reward,
        probabilities=tuple(logged.probabilities),
        other_probabilities=tuple(other.probabilities[i] for i in where),
    )  # fmt: skip


def compare_recordings(
    paths: Sequence[Path], policy: OtherPolicy, workers: int = 0, scheduler: str = ""
) -> Iterator[ComparedRecording]:
    """Yield what :func:`compare_recording` finds in each recording, in their order."""
    yield from for_each(partial(compare_recording, policy=policy), paths, workers, scheduler)


# --- the answer over all recordings ---


@dataclass(frozen=True)
class WizardState:
    """What people did in one cognitive state where they overrode SHIFT's choice."""

    overrides: int
    agree: int
    """How often SHIFT would have chosen the same."""
    expected: float
    """The mean probability that SHIFT gave to what the person chose."""
    chosen: tuple[int, ...]
    """How often the person chose each strategy."""


@dataclass
class WhatIf:
    """The answer of a what-if over all recordings."""

    recordings: list[ComparedRecording] = field(default_factory=list)
    problems: dict[str, str] = field(default_factory=dict)
    states: dict[str, list[int]] = field(default_factory=dict)
    """For each cognitive state: how often it was recorded, and how often it would have been."""
    strategies: dict[str, list[int]] = field(default_factory=dict)
    value: list[Estimate] = field(default_factory=list)
    logged: Estimate | None = None
    support: float | None = None
    wizard: dict[str, WizardState] = field(default_factory=dict)
    """By cognitive state; empty without overrides."""
    warnings: list[str] = field(default_factory=list)

    @property
    def decisions(self) -> list[ComparedDecision]:
        """The decisions of all recordings."""
        return [decision for recording in self.recordings for decision in recording.decisions]

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the strategies."""
        return next((recording.actions for recording in self.recordings if recording.actions), ())

    def as_json(self) -> dict[str, Any]:
        """Return the answer as ``--json`` prints it."""
        decisions = self.decisions
        return {
            "recordings": len(self.recordings), "decisions": len(decisions),
            "differ": sum(each.differs for each in decisions), "states": self.states, "strategies": self.strategies,
            "value": [estimate.as_json() for estimate in self.value],
            "logged": self.logged.as_json() if self.logged else None,
            "support": self.support,
            "wizard": {name: _wizard_json(state, self.actions) for name, state in self.wizard.items()},
            "warnings": self.warnings, "problems": self.problems,
        }  # fmt: skip


def _wizard_json(state: WizardState, actions: tuple[str, ...]) -> dict[str, Any]:
    return {
        "overrides": state.overrides, "agree": state.agree, "expected": state.expected,
        "chosen": dict(zip(actions, state.chosen, strict=True)),
    }  # fmt: skip


def what_if(compared: Iterable[ComparedRecording]) -> WhatIf:
    """Return the answer over the recordings. Raise :class:`InvalidStudy` if their strategies differ."""
    answer = WhatIf()
    for recording in compared:
        if recording.problem:
            answer.problems[recording.file] = recording.problem
        else:
            answer.recordings.append(recording)
    names = {recording.actions for recording in answer.recordings if recording.actions}
    if len(names) > 1:
        raise InvalidStudy("the recordings have different strategies; ask for those of one study at a time")
    decisions = answer.decisions
    answer.states = _counts((each.state, each.other_state) for each in decisions)
    answer.strategies = _counts((answer.actions[e.action], answer.actions[e.other_action]) for e in decisions)
    answer.wizard = _wizard(decisions, len(answer.actions))
    chances = [each for each in decisions if each.propensity is not None]
    answer.support = sum(each.is_supported for each in chances) / len(chances) if chances else None
    logged = logged_decisions(answer.recordings)
    answer.value = estimate_values(logged)
    answer.logged = logged_value(logged) if len(logged) else None
    answer.warnings = _warnings(answer, logged)
    return answer


def logged_decisions(recordings: Sequence[ComparedRecording]) -> LoggedDecisions:
    """Return the decisions with a reward and a propensity, as the estimators need them."""
    pairs = [
        (recording.participant, each)
        for recording in recordings
        for each in recording.decisions
        if each.reward is not None and each.propensity
    ]
    states = {name: i for i, name in enumerate(dict.fromkeys(each.state for _, each in pairs))}
    people = {name: i for i, name in enumerate(dict.fromkeys(name for name, _ in pairs))}
    width = len(pairs[0][1].other_probabilities) if pairs else 0
    return LoggedDecisions(
        reward=np.array([each.reward for _, each in pairs], dtype=float),
        action=np.array([each.action for _, each in pairs], dtype=np.int64),
        propensity=np.array([each.propensity for _, each in pairs], dtype=float),
        other=np.array([each.other_probabilities for _, each in pairs], dtype=float).reshape(len(pairs), width),
        state=np.array([states[each.state] for _, each in pairs], dtype=np.int64),
        group=np.array([people[name] for name, _ in pairs], dtype=np.int64),
    )


def _counts(pairs: Iterable[tuple[str, str]]) -> dict[str, list[int]]:
    logged: Counter[str] = Counter()
    other: Counter[str] = Counter()
    for before, after in pairs:
        logged[before] += 1
        other[after] += 1
    return {name: [logged[name], other[name]] for name in sorted(logged | other)}


def _wizard(decisions: Sequence[ComparedDecision], actions: int) -> dict[str, WizardState]:
    found = {}
    overridden = [each for each in decisions if each.source == "override"]
    for name in sorted({each.state for each in overridden}):
        mine = [each for each in overridden if each.state == name]
        found[name] = WizardState(
            overrides=len(mine), agree=sum(each.own == each.action for each in mine),
            expected=sum(each.probabilities[each.action] for each in mine) / len(mine),
            chosen=tuple(sum(each.action == action for each in mine) for action in range(actions)),
        )  # fmt: skip
    return found


# --- what the numbers cannot say ---


def _warnings(answer: WhatIf, logged: LoggedDecisions) -> list[str]:
    """Return what a reader must know before using the values."""
    decisions = answer.decisions
    if not decisions:
        return ["there is no decision that could be made again"]
    return [*_about_the_log(answer, decisions), *_about_the_weights(answer, logged)]


def _about_the_log(answer: WhatIf, decisions: Sequence[ComparedDecision]) -> Iterator[str]:
    overrides = sum(each.source == "override" for each in decisions)
    if overrides:
        yield (
            f"{overrides} of {len(decisions)} decisions were overridden by a person; they have no propensity and are "
            "left out of the value"
        )
    reported = sum(each.reward is not None for each in decisions)
    if reported < len(decisions):
        yield f"{len(decisions) - reported} of {len(decisions)} decisions have no report and are left out of the value"
    changes = sum(recording.changes for recording in answer.recordings)
    if changes:
        yield f"changes of the study while sessions ran: {changes}. The value is over all of its versions"


def _about_the_weights(answer: WhatIf, logged: LoggedDecisions) -> Iterator[str]:
    if not len(logged):
        yield "no decision has a reward and a propensity, so there is no value"
        return
    if answer.support is not None and answer.support < 1:
        yield (
            f"in {100 * (1 - answer.support):.1f} % of the decisions the other policy could have chosen a strategy "
            "whose recorded probability was 0: the recording cannot say what it would have led to. The value is biased "
            "there. decider.minimum_propensity in the study prevents this"
        )
    ess, weights = answer.value[0].ess, logged.weights
    if ess < FEW:
        yield f"the effective sample size is {ess:.1f}, below {FEW}: the intervals are not to be relied on"
    if weights.sum() > 0 and weights.max() / weights.sum() > LARGE_WEIGHT:
        share = 100 * weights.max() / weights.sum()
        yield f"one decision has {share:.0f} % of all the weight and decides the estimates"
    if not is_over_participants(logged):
        people = len(np.unique(logged.group))
        yield (
            f"participants: {people}, fewer than {PARTICIPANTS}. The intervals are over decisions and say nothing of "
            "other people"
        )
