"""The learner's core: ``step(state, message, now) -> Step``. Pure.

It folds decisions and configurations, answers ``report_performance``, and publishes a new policy after each of them.
A policy holds for one decision number, because exploration, untaken actions and planning depend on the number. A
report gives a performance, a transition (the update that was learned) and a policy. With a discount above 0, the
transition waits for the next decision or for the session's end.
"""

from __future__ import annotations

from dataclasses import replace

from shift_model.vocabulary import Triple
from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict, UnknownThing
from shift_schemas.lifecycle import check_accepts, is_ending
from shift_schemas.messages import (
    Command,
    Config,
    Decision,
    Fact,
    Performance,
    Policy,
    PolicyRow,
    ReportPerformance,
    Session,
    Transition,
)
from shift_schemas.timestamps import Stamp

from shift_learner.learner import Context, DecisionView, state_names, state_of
from shift_learner.reports import CORRECTABLE, check_known, performance_of, repeats, with_report, without_report
from shift_learner.state import LearnerState, OpenDecision, Reported, context_of, dump, load

__all__ = ["CORRECTABLE", "LearnerState", "context_of", "dump", "load", "step"]


def step(
    state: LearnerState | None, message: Fact | Command, now: Stamp, timed_out: bool = False
) -> Step[LearnerState]:
    """Fold one message of a session.

    Raises
    ------
    InputsMissing
        A report must wait for its decision or configuration, and ``timed_out`` is not set.
    UnknownThing, Conflict, Unavailable
        The report is refused.
    """
    if isinstance(message, Session):
        if state is None:
            return Step(LearnerState(message.session, message.state, format=message.format))
        return _on_end(replace(state, phase=message.state), now)
    if state is None:
        raise UnknownThing(f"there is no session {message.session}")
    match message:
        case Config():
            return _on_config(state, message, now)
        case Decision():
            return _on_decision(state, message, now)
        case ReportPerformance():
            return _on_report(state, message, now, timed_out)
    return Step(state)


# --- inputs ---


def _on_config(state: LearnerState, config: Config, now: Stamp) -> Step[LearnerState]:
    after = replace(state, config=config)
    if state.config is None:
        after = replace(after, memory=after.learner.initial(after.context))
    return _with_policy(after, (), now)


def _on_decision(state: LearnerState, decision: Decision, now: Stamp) -> Step[LearnerState]:
    taken = _taken(state.context, decision)
    opened = {**state.open, decision.decision_id: OpenDecision(decision.task, taken, decision.versions)}
    previous = next(reversed(state.open), None)  # the newest open one; the last decision may be reported already
    if previous is not None and state.open[previous].taken == state.last:
        opened[previous] = replace(state.open[previous], following=taken)
    else:
        previous = None
    after = replace(
        state,
        memory=state.learner.on_decision(state.context, state.memory, taken),
        open=opened,
        last=taken,
        decisions=decision.n,
    )
    facts: tuple[Fact, ...] = ()
    if previous in state.rewards:
        after, transition = _update(after, previous, now)
        facts = (transition,)
    return _with_policy(after, facts, now)


def _taken(context: Context, decision: Decision) -> DecisionView:
    seen = decision.observation
    return DecisionView(
        n=decision.n,
        triple=Triple(seen.capacity, seen.gaze, seen.awareness).number,
        cognitive_state=context.cognitive_states.index(decision.cognitive_state),
        action=decision.actions.index(decision.strategy),
        propensity=decision.propensity,
    )


def _on_report(state: LearnerState, command: ReportPerformance, now: Stamp, timed_out: bool) -> Step[LearnerState]:
    check_accepts(state.session, state.phase, command)
    check_known(state, command, timed_out)
    if command.corrects is not None:
        return _on_correction(state, command, now)
    decision_id = command.decision_id
    if decision_id in state.rewards:
        raise Conflict(f"decision {decision_id} has its performance already")
    known = state.open[decision_id]
    performance = performance_of(state, command, known.task, now)
    return _learn(with_report(state, performance, known), performance, now)


def _on_correction(state: LearnerState, command: ReportPerformance, now: Stamp) -> Step[LearnerState]:
    """Replace an earlier report; the new one is learned from in addition."""
    known = state.reported[command.decision_id]
    before = known.performance
    if repeats(command, before):
        return Step(state, result=before.model_dump(mode="json"), repeat=True)
    performance = performance_of(state, command, before.task, now, before)
    return _learn(with_report(state, performance, known.open), performance, now)


def _on_end(state: LearnerState, now: Stamp) -> Step[LearnerState]:
    """Learn from the reports that wait for a next decision, which will not come."""
    if not is_ending(state.phase) or not state.rewards:
        return Step(state)
    facts: list[Fact] = []
    for decision_id in list(state.rewards):
        state, transition = _update(state, decision_id, now)
        facts.append(transition)
    return _with_policy(state, tuple(facts), now)


# --- learning ---


def _learn(state: LearnerState, performance: Performance, now: Stamp) -> Step[LearnerState]:
    """Learn from a report at once, unless the learner needs the next decision and there is none yet.

    While the learner is paused, the report is recorded and its reward counts, but nothing is learned from it.
    """
    facts: tuple[Fact, ...] = (performance,)
    if state.context.study.learner.paused:
        return replace(_with_policy(without_report(state, performance.decision_id), facts, now), result=performance)
    known = state.open[performance.decision_id]
    waits = state.learner.needs_following(state.context) and known.following is None
    if not waits:
        state, transition = _update(state, performance.decision_id, now)
        facts = (performance, transition)
    return replace(_with_policy(state, facts, now), result=performance)


def _update(state: LearnerState, decision_id: str, now: Stamp) -> tuple[LearnerState, Transition]:
    """Learn from a reported decision, with the decision that followed it if there is one."""
    context, learner = state.context, state.learner
    known, gained = state.open[decision_id], state.rewards[decision_id]
    memory = learner.on_reward(context, state.memory, known.taken, gained, known.following)
    row = state_of(learner, known.taken)
    transition = Transition(
        session=state.session, stamp=now, seen=state.seen, decision_id=decision_id, task=known.task,
        state=state_names(learner, context)[row],
        action=context.study.scoring.choices[known.taken.action],
        reward=gained, propensity=known.taken.propensity, versions=known.versions,
        value=learner.row(context, memory, row).values[known.taken.action],
    )  # fmt: skip
    after = replace(
        without_report(state, decision_id), memory=memory, reported=_with_following(state, decision_id, known)
    )
    return after, transition


def _with_following(state: LearnerState, decision_id: str, known: OpenDecision) -> dict[str, Reported]:
    """Return the reports with the decision as it was learned from, so that a correction is learned the same way."""
    if (reported := state.reported.get(decision_id)) is None:
        return state.reported
    return state.reported | {decision_id: replace(reported, open=known)}


def _with_policy(state: LearnerState, facts: tuple[Fact, ...], now: Stamp) -> Step[LearnerState]:
    """Return a step that publishes these facts and, as the last one, the next policy."""
    after = replace(state, version=state.version + 1)
    context, learner = after.context, after.learner
    rows = {}
    for index, name in enumerate(state_names(learner, context)):
        row = learner.row(context, after.memory, index)
        rows[name] = PolicyRow(probabilities=row.probabilities, values=row.values, visits=row.visits)
    policy = Policy(
        session=after.session, stamp=now, seen=after.seen, version=after.version,
        learner=context.study.learner.name, for_n=after.decisions + 1,
        actions=list(context.study.scoring.choices), states=rows,
        epsilon=learner.epsilon(context, after.memory), cumulative_reward=after.cumulative_reward,
    )  # fmt: skip
    return Step(after, (*facts, policy))
