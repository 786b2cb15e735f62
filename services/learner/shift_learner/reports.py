"""Reports of performance: which are refused, what is recorded of them, and what the state keeps. Pure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from shift_model.reward import reward, task_performance
from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Conflict, Unavailable, UnknownThing
from shift_schemas.messages import Performance, ReportPerformance, Result, ScoredResult
from shift_schemas.timestamps import Stamp

from shift_learner.state import LearnerState, OpenDecision, Reported

WAIT_S = 2.0
"""Chosen: how long a report waits for its decision or configuration, s; as the decider's."""
LONGEST_PLAUSIBLE_S = 3600.0
"""Chosen: a longer task causes a warning, since its time was probably sent in milliseconds."""
CORRECTABLE = 256
"""Chosen: the number of the last reported decisions that can be corrected; each is kept in the state."""


def check_known(state: LearnerState, command: ReportPerformance, timed_out: bool) -> None:
    """Raise an error if the report's decision or configuration is not known.

    Raises
    ------
    InputsMissing
        They may still come, and ``timed_out`` is not set.
    Unavailable
        They did not come in time.
    UnknownThing
        There is no such decision, or its report is too old to be corrected.
    Conflict
        There is no report to correct yet.
    """
    behind = _owners_behind(state, command)
    if behind and not timed_out:
        raise InputsMissing(behind, WAIT_S)
    if state.config is None or state.decisions < command.need.decision:
        raise Unavailable(f"the learner has not heard all of the {' and the '.join(behind)} yet")
    if command.corrects is not None and command.corrects in state.reported:
        return
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


def performance_of(
    state: LearnerState, command: ReportPerformance, task: str, now: Stamp, before: Performance | None = None
) -> Performance:
    """Return the report as it is recorded, with its reward; ``before`` is the report that it corrects."""
    settings = state.context.study.reward
    comprehension = _scored(command.comprehension, settings.decay)
    enabledness = _scored(command.enabledness, settings.decay)
    gained = reward(comprehension.value, enabledness.value, settings.scale)
    return Performance(
        session=state.session, stamp=now, seen=state.seen, decision_id=command.decision_id,
        task=task, n=state.performances + 1, comprehension=comprehension, enabledness=enabledness, reward=gained,
        cumulative_reward=state.cumulative_reward + gained - (before.reward if before else 0.0),
        corrects=before is not None, author=command.author,
        **(_format_2_fields(state, command, task, before) if state.format > 1 else {}),
    )  # fmt: skip


def repeats(command: ReportPerformance, performance: Performance) -> bool:
    """Return whether the command reports the same results as a recorded report."""
    both = (performance.comprehension, performance.enabledness)
    results = tuple(Result(success=r.success, duration_s=r.duration_s) for r in both)
    return results == (command.comprehension, command.enabledness)


def with_report(state: LearnerState, performance: Performance, known: OpenDecision) -> LearnerState:
    """Return the state with a report in force that is not learned from yet."""
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


def without_report(state: LearnerState, decision_id: str) -> LearnerState:
    """Return the state in which a report does not wait any more to be learned from."""
    return replace(
        state,
        open={i: o for i, o in state.open.items() if i != decision_id},
        rewards={i: r for i, r in state.rewards.items() if i != decision_id},
    )


def _owners_behind(state: LearnerState, command: ReportPerformance) -> tuple[str, ...]:
    """Return the owners whose facts the report needs and the learner has not read."""
    config_missing = state.config is None or state.config.version < command.need.config
    known = command.decision_id in state.open or command.corrects in state.reported
    decision_missing = not known or state.decisions < command.need.decision
    lacking = (("recorder", config_missing), ("decider", decision_missing))
    return tuple(owner for owner, missing in lacking if missing)


def _format_2_fields(
    state: LearnerState, command: ReportPerformance, task: str, before: Performance | None
) -> dict[str, Any]:
    """Return the fields of a report that a session of format 1 does not record."""
    warnings = [
        f"{name}.duration_s is {given.duration_s:g} s, more than an hour: it must be in seconds, so divide "
        "milliseconds by 1000; a report can be corrected with corrects: true"
        for name, given in (("comprehension", command.comprehension), ("enabledness", command.enabledness))
        if given.duration_s > LONGEST_PLAUSIBLE_S
    ]
    return {"result": before.result if before else state.results.get(task, 0) + 1, "warnings": warnings}


def _scored(result: Result, decay: float) -> ScoredResult:
    value = task_performance(result.success, result.duration_s, decay)
    return ScoredResult(success=result.success, duration_s=result.duration_s, value=value)
