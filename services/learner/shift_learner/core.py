"""The learner's core: ``step(state, message, now) -> Step``. Pure.

It folds decisions and configurations, answers ``report_performance`` and puts out a new policy after
each of them: a policy holds for one decision number, since exploration, untaken actions and planning
depend on both. A report gives a performance, a transition (what was learned from) and a policy. With
a discount above 0 the transition waits for the next decision, or for the session's end.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter
from shift_model.reward import reward, task_performance
from shift_model.vocabulary import Triple
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import Conflict, Unavailable, UnknownThing
from shift_schemas.lifecycle import LIVE, check_accepts, is_ending
from shift_schemas.messages import (
    Command,
    Config,
    Decision,
    Fact,
    Performance,
    Policy,
    PolicyRow,
    ReportPerformance,
    Result,
    ScoredResult,
    Seen,
    Session,
    SessionState,
    Transition,
    Versions,
)
from shift_schemas.timestamps import Stamp
from shift_study.loading import study_from_json

from shift_learner.learner import Context, Learner, Taken, state_names, state_of
from shift_learner.learners import learner_named

WAIT_S = 2.0
"""How long a report waits for its decision or configuration to come in; chosen, as the decider's."""
LONGEST_PLAUSIBLE_S = 3600.0
"""Chosen: a task that takes longer is told of, for it is likelier that milliseconds were meant."""
CORRECTABLE = 256
"""Chosen: so many of the last reported decisions can be corrected; each is kept in the state."""


@dataclass(frozen=True)
class Open:
    """A decision whose report has not come, or whose update has not been made."""

    task: str
    taken: Taken
    versions: Versions
    following: Taken | None = None
    """The decision after it, once there is one."""


@dataclass(frozen=True)
class Reported:
    """A reported decision, as far as a correction needs it."""

    open: Open
    performance: Performance
    """The report in force."""


@dataclass(frozen=True)
class LearnerState:
    """All that the learner knows of one session. ``memory`` is the learner's own, as plain JSON on disk."""

    session: str
    phase: SessionState = LIVE
    config: Config | None = None
    memory: Any = None
    open: dict[str, Open] = field(default_factory=dict)
    rewards: dict[str, float] = field(default_factory=dict)
    """Reported, and waiting for the decision that follows."""
    reported: dict[str, Reported] = field(default_factory=dict)
    results: dict[str, int] = field(default_factory=dict)
    """Reports of each task, corrections not counted."""
    format: int = 1
    """What the session records (``shift_schemas.messages.FORMAT``)."""
    last: Taken | None = None
    decisions: int = 0
    performances: int = 0
    cumulative_reward: float = 0.0
    version: int = 0


_STATE = TypeAdapter(LearnerState)


def dump(state: LearnerState) -> str:
    """The state as JSON; :func:`load` takes it back exactly."""
    plain = state if state.config is None else replace(state, memory=_learner(state).dump(state.memory))
    return _STATE.dump_json(plain).decode()


def load(text: str) -> LearnerState:
    """The state that :func:`dump` wrote."""
    state = _STATE.validate_json(text)
    if state.config is None:
        return state
    return replace(state, memory=_learner(state).load(_context(state), state.memory))


@lru_cache(maxsize=64)
def context_of(study: str) -> Context:
    """The context of a study in force, given as ``config`` facts carry it."""
    return Context(study_from_json(study))


def step(
    state: LearnerState | None, message: Fact | Command, now: Stamp, timed_out: bool = False
) -> Step[LearnerState]:
    """Fold one message of a session.

    Raises
    ------
    InputsMissing
        A report must wait for its decision or configuration, and ``timed_out`` is not set.
    UnknownThing, Conflict, Unavailable
        The report cannot be taken.
    """
    if isinstance(message, Session):
        if state is None:
            return Step(LearnerState(message.session, message.state, format=message.format))
        return _ended(replace(state, phase=message.state), now)
    if state is None:
        raise UnknownThing(f"there is no session {message.session}")
    match message:
        case Config():
            return _configured(state, message, now)
        case Decision():
            return _decided(state, message, now)
        case ReportPerformance():
            return _reported(state, message, now, timed_out)
    return Step(state)


# --- what each input does ---


def _configured(state: LearnerState, config: Config, now: Stamp) -> Step[LearnerState]:
    after = replace(state, config=config)
    if state.config is None:
        after = replace(after, memory=_learner(after).initial(_context(after)))
    return _with_policy(after, (), now)


def _decided(state: LearnerState, decision: Decision, now: Stamp) -> Step[LearnerState]:
    context, learner = _context(state), _learner(state)
    triple = Triple(decision.observation.capacity, decision.observation.gaze, decision.observation.awareness)
    taken = Taken(
        n=decision.n,
        triple=triple.number,
        cognitive_state=context.cognitive_states.index(decision.cognitive_state),
        action=decision.actions.index(decision.strategy),
        propensity=decision.propensity,
    )
    opened = {**state.open, decision.decision_id: Open(decision.task, taken, decision.versions)}
    previous = next(reversed(state.open), None)  # the newest that is open; the last decision may be no more
    if previous is not None and state.open[previous].taken == state.last:
        opened[previous] = replace(state.open[previous], following=taken)
    else:
        previous = None
    after = replace(
        state,
        memory=learner.on_decision(context, state.memory, taken),
        open=opened,
        last=taken,
        decisions=decision.n,
    )
    facts: tuple[Fact, ...] = ()
    if previous in state.rewards:
        after, transition = _updated(after, previous, now)
        facts = (transition,)
    return _with_policy(after, facts, now)


def _reported(state: LearnerState, command: ReportPerformance, now: Stamp, timed_out: bool) -> Step[LearnerState]:
    check_accepts(state.session, state.phase, command)
    if command.corrects is not None and command.corrects in state.reported:
        return _corrected(state, command, now)
    _check_known(state, command, timed_out)
    decision_id = command.decision_id
    if decision_id in state.rewards:
        raise Conflict(f"decision {decision_id} has its performance already")
    performance = _performance(state, command, state.open[decision_id].task, now)
    return _learned(_counted(state, performance, state.open[decision_id]), performance, now)


def _corrected(state: LearnerState, command: ReportPerformance, now: Stamp) -> Step[LearnerState]:
    """Put another report in the place of an earlier one: it is applied once more, as the new value."""
    known = state.reported[command.decision_id]
    before = known.performance
    if _results(before) == (command.comprehension, command.enabledness):
        return Step(state, result=before.model_dump(mode="json"), repeat=True)
    performance = _performance(state, command, before.task, now, before)
    return _learned(_counted(state, performance, known.open), performance, now)


def _results(performance: Performance) -> tuple[Result, Result]:
    """What was reported, without what was made of it."""
    both = (performance.comprehension, performance.enabledness)
    comprehension, enabledness = (Result(success=r.success, duration_s=r.duration_s) for r in both)
    return comprehension, enabledness


def _counted(state: LearnerState, performance: Performance, known: Open) -> LearnerState:
    """The state with a report in force that is still to be learned from."""
    decision_id, task = performance.decision_id, performance.task
    kept = {i: r for i, r in state.reported.items() if i != decision_id}
    if len(kept) >= CORRECTABLE:
        kept.pop(next(iter(kept)))
    return replace(
        state,
        performances=performance.n,
        cumulative_reward=performance.cumulative_reward,
        rewards={**state.rewards, decision_id: performance.reward},
        open={**state.open, decision_id: state.open.get(decision_id, known)},
        reported=kept | {decision_id: Reported(known, performance)} if state.format > 1 else {},
        results={**state.results, task: max(performance.result, state.results.get(task, 0))},
    )


def _learned(state: LearnerState, performance: Performance, now: Stamp) -> Step[LearnerState]:
    """Learn from a report at once, unless the learner needs the decision that follows and there is none yet."""
    facts: tuple[Fact, ...] = (performance,)
    known = state.open[performance.decision_id]
    waits = _learner(state).needs_following(_context(state)) and known.following is None
    if not waits:
        state, transition = _updated(state, performance.decision_id, now)
        facts = (performance, transition)
    return replace(_with_policy(state, facts, now), result=performance)


def _ended(state: LearnerState, now: Stamp) -> Step[LearnerState]:
    """What waited for a next decision that will not come is learned without one."""
    if not is_ending(state.phase) or not state.rewards:
        return Step(state)
    facts: list[Fact] = []
    for decision_id in list(state.rewards):
        state, transition = _updated(state, decision_id, now)
        facts.append(transition)
    return _with_policy(state, tuple(facts), now)


# --- pieces ---


def _check_known(state: LearnerState, command: ReportPerformance, timed_out: bool) -> None:
    behind = tuple(
        owner
        for owner, lacking in (
            ("recorder", state.config is None or state.config.version < command.need.config),
            ("decider", command.decision_id not in state.open or state.decisions < command.need.decision),
        )
        if lacking
    )
    if behind and not timed_out:
        raise InputsMissing(behind, WAIT_S)
    if state.config is None or state.decisions < command.need.decision:
        raise Unavailable(f"the learner has not heard all of the {' and the '.join(behind)} yet")
    if command.corrects is not None and command.decision_id not in state.open:
        raise UnknownThing(
            f"session {state.session} has no report of decision {command.corrects} that can be corrected; "
            f"the last {CORRECTABLE} reports can be"
        )
    if command.decision_id not in state.open:
        raise UnknownThing(f"session {state.session} has no decision {command.decision_id} that waits for a result")
    if command.corrects is not None:
        raise Conflict(
            f"decision {command.corrects} has no report yet that could be corrected; send it without corrects"
        )


def _performance(
    state: LearnerState, command: ReportPerformance, task: str, now: Stamp, before: Performance | None = None
) -> Performance:
    """The report as it is recorded; ``before`` is the one that it replaces."""
    settings = _context(state).study.reward
    comprehension = _scored(command.comprehension, settings.decay)
    enabledness = _scored(command.enabledness, settings.decay)
    gained = reward(comprehension.value, enabledness.value, settings.scale)
    return Performance(
        session=state.session, stamp=now, seen=_seen(state), decision_id=command.decision_id,
        task=task, n=state.performances + 1, comprehension=comprehension, enabledness=enabledness, reward=gained,
        cumulative_reward=state.cumulative_reward + gained - (before.reward if before else 0.0),
        corrects=before is not None, **(_beside(state, command, task, before) if state.format > 1 else {}),
    )  # fmt: skip


def _beside(state: LearnerState, command: ReportPerformance, task: str, before: Performance | None) -> dict[str, Any]:
    """What a session of format 1 did not record of a report."""
    warnings = [
        f"{name}.duration_s is {given.duration_s:g} s, more than an hour: it must be in seconds, so divide "
        "milliseconds by 1000; a report can be corrected with corrects: true"
        for name, given in (("comprehension", command.comprehension), ("enabledness", command.enabledness))
        if given.duration_s > LONGEST_PLAUSIBLE_S
    ]
    return {"result": before.result if before else state.results.get(task, 0) + 1, "warnings": warnings}


def _updated(state: LearnerState, decision_id: str, now: Stamp) -> tuple[LearnerState, Transition]:
    """Learn from a reported decision, with the one that followed it where there is one."""
    context, learner = _context(state), _learner(state)
    known, gained = state.open[decision_id], state.rewards[decision_id]
    memory = learner.on_reward(context, state.memory, known.taken, gained, known.following)
    row = state_of(learner, known.taken)
    transition = Transition(
        session=state.session, stamp=now, seen=_seen(state), decision_id=decision_id, task=known.task,
        state=state_names(learner, context)[row],
        action=context.study.scoring.choices[known.taken.action],
        reward=gained, propensity=known.taken.propensity, versions=known.versions,
        value=learner.row(context, memory, row).values[known.taken.action],
    )  # fmt: skip
    after = replace(
        state,
        memory=memory,
        open={i: o for i, o in state.open.items() if i != decision_id},
        rewards={i: r for i, r in state.rewards.items() if i != decision_id},
        reported=_with_open(state, decision_id, known),
    )
    return after, transition


def _with_open(state: LearnerState, decision_id: str, known: Open) -> dict[str, Reported]:
    """The reports with the decision as it was learned from: a correction is learned from in the same way."""
    if (reported := state.reported.get(decision_id)) is None:
        return state.reported
    return state.reported | {decision_id: replace(reported, open=known)}


def _with_policy(state: LearnerState, facts: tuple[Fact, ...], now: Stamp) -> Step[LearnerState]:
    after = replace(state, version=state.version + 1)
    context, learner = _context(after), _learner(after)
    rows = {}
    for index, name in enumerate(state_names(learner, context)):
        row = learner.row(context, after.memory, index)
        rows[name] = PolicyRow(probabilities=row.probabilities, values=row.values, visits=row.visits)
    policy = Policy(
        session=after.session, stamp=now, seen=_seen(after), version=after.version,
        learner=context.study.learner.name, for_n=after.decisions + 1,
        actions=list(context.study.scoring.choices), states=rows,
        epsilon=learner.epsilon(context, after.memory), cumulative_reward=after.cumulative_reward,
    )  # fmt: skip
    return Step(after, (*facts, policy))


def _seen(state: LearnerState) -> Seen:
    return Seen(
        decision=state.decisions,
        performance=state.performances,
        config=state.config.version if state.config else 0,
    )


def _context(state: LearnerState) -> Context:
    if state.config is None:
        raise Unavailable("the recorder has not published a configuration of this session yet; ask again")
    return context_of(state.config.study)


def _learner(state: LearnerState) -> Learner:
    return learner_named(_context(state).study.learner.name)


def _scored(result: Result, decay: float) -> ScoredResult:
    value = task_performance(result.success, result.duration_s, decay)
    return ScoredResult(success=result.success, duration_s=result.duration_s, value=value)
