"""The decider's core: ``step(state, message, now) -> Step``. Pure.

It folds observations, policies and configurations, publishes estimates, and answers ``decide`` and ``override``.
A decision requires an observation that includes all earlier decisions and everything that the caller was told
before, and the policy for its own number. If these do not arrive within ``wait_s``, the decision is made with the
inputs that are there, and says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from pydantic import TypeAdapter
from shift_model.random_numbers import pick, uniform
from shift_model.vocabulary import PolicySource, Triple
from shift_schemas.core_protocol import InputsMissing, Step, covers_gaze
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, Unavailable, UnknownThing, shorten
from shift_schemas.lifecycle import LIVE, check_accepts
from shift_schemas.messages import (
    Command,
    Config,
    Decide,
    Decision,
    Estimate,
    Fact,
    GazeView,
    Observation,
    Override,
    Policy,
    Seen,
    Session,
    SessionState,
    SetOverride,
    Strategy,
    Versions,
)
from shift_schemas.suggestions import did_you_mean
from shift_schemas.timestamps import NS, Stamp
from shift_study.loading import study_from_json
from shift_study.phrases import text_for
from shift_study.scoring import Reduction, reductions, view
from shift_study.study import Study

ANY_TASK = ""
"""The task of the estimate that stands for every task without results."""


@dataclass(frozen=True)
class DeciderState:
    """The decider's state of one session."""

    session: str
    seed: int
    phase: SessionState = LIVE
    config: Config | None = None
    observation: Observation | None = None
    policy: Policy | None = None
    n: int = 0
    overrides: dict[str, Override] = field(default_factory=dict)
    estimates: dict[str, tuple[dict[str, float], str]] = field(default_factory=dict)
    """The scores and the cognitive state that were published last, by task."""
    format: int = 1
    """The format that the session records in (``shift_schemas.messages.FORMAT``)."""

    @property
    def records_inputs(self) -> bool:
        """Whether the outputs record the order of the inputs and what each decision required: from format 3 on."""
        return self.format >= 3

    @property
    def records_own_choice(self) -> bool:
        """Whether an overridden decision records what SHIFT would have chosen: from format 5 on."""
        return self.format >= 5

    @property
    def records_gaze_quality(self) -> bool:
        """Whether a decision names the age and the validity of the gaze that it rests on: from format 6 on."""
        return self.format >= 6


_STATE = TypeAdapter(DeciderState)


def dump(state: DeciderState) -> str:
    """Return the state as JSON. :func:`load` restores it exactly."""
    return _STATE.dump_json(state).decode()


def load(text: str) -> DeciderState:
    """Return the state that :func:`dump` wrote."""
    return _STATE.validate_json(text)


def step(
    state: DeciderState | None, message: Fact | Command, now: Stamp, timed_out: bool = False
) -> Step[DeciderState]:
    """Fold one message of a session.

    Raises
    ------
    InputsMissing
        A decision must wait for the monitor, the learner or the recorder, and ``timed_out`` is not set.
    UnknownThing, Conflict, MalformedMessage, Unavailable
        The command cannot be carried out.
    """
    if isinstance(message, Session):
        if state is None:
            return Step(DeciderState(message.session, message.seed, message.state, format=message.format))
        return Step(replace(state, phase=message.state))
    if state is None:
        raise UnknownThing(f"there is no session {message.session}")
    match message:
        case Config():
            return _estimate(replace(state, config=message), now, unchanged=state.records_inputs)
        case Observation():
            return _estimate(replace(state, observation=message), now)
        case Policy():
            return Step(replace(state, policy=message))
        case Decide():
            return _on_decide(state, message, now, timed_out)
        case SetOverride():
            return _on_override(state, message, now, timed_out)
    return Step(state)


# --- estimates ---


def _estimate(state: DeciderState, now: Stamp, unchanged: bool = False) -> Step[DeciderState]:
    """Publish an estimate for each task whose scores or cognitive state changed; if ``unchanged``, for every task.

    A configuration publishes estimates for every task, so that the outputs record when the decider read it:
    ``seen`` of an estimate then determines the order of configurations and observations.
    """
    if state.config is None or state.observation is None:
        return Step(state)
    study = study_from_json(state.config.study)
    tasks = list(study.tasks) if study.tasks is not None else [ANY_TASK, *state.observation.awareness]
    known = dict(state.estimates)
    facts = []
    for task in tasks:
        triple = triple_of(state.observation, task)
        found = reductions(state.config.study)[triple]
        if unchanged or known.get(task) != (found.scores, found.cognitive_state):
            known[task] = (found.scores, found.cognitive_state)
            facts.append(
                Estimate(
                    session=state.session, stamp=now, seen=_seen(state), task=task, observation=view(triple),
                    scores=found.scores, cognitive_state=found.cognitive_state,
                    suggested=study.scoring.choices[found.action],
                )
            )  # fmt: skip
    return Step(replace(state, estimates=known), tuple(facts))


def triple_of(observation: Observation, task: str) -> Triple:
    """Return the monitoring state of a task. The awareness of a task without results is unknown."""
    results = observation.awareness.get(task)
    return Triple(observation.capacity.category, observation.gaze.category, results.category if results else "unknown")


def _seen(state: DeciderState) -> Seen:
    observed = state.observation.seen if state.observation else Seen()
    return Seen(
        gaze=observed.gaze,
        decision=state.n,
        performance=observed.performance,
        config=state.config.version if state.config else 0,
        observation=state.observation.version if state.observation else 0,
        policy=state.policy.version if state.policy else 0,
    )


# --- decisions ---


class MissingInputs(NamedTuple):
    """Which inputs of a decision have not been read yet."""

    config: bool
    observation: bool
    policy: bool

    @property
    def owners(self) -> tuple[str, ...]:
        """The services that publish them."""
        return tuple(o for o, missing in zip(("recorder", "monitor", "learner"), self, strict=True) if missing)


def missing_inputs(state: DeciderState, required: Seen) -> MissingInputs:
    """Return which inputs of the next decision are missing; ``required`` is what the caller was told before."""
    version = state.config.version if state.config else 0

    def is_behind(seen: Seen) -> bool:
        return (
            seen.decision < max(required.decision, state.n)
            or seen.config < max(required.config, version)
            or seen.performance < required.performance
        )

    observation, policy = state.observation, state.policy
    return MissingInputs(
        config=version < max(1, required.config),
        observation=observation is None
        or observation.version < required.observation
        or is_behind(observation.seen)
        or not covers_gaze(observation.seen, required),
        policy=policy is None or policy.for_n != state.n + 1 or is_behind(policy.seen),
    )


def _on_decide(state: DeciderState, command: Decide, now: Stamp, timed_out: bool) -> Step[DeciderState]:
    decision = decide(state, command.task, command.command_id, command.need, now, timed_out)
    overrides = {task: o for task, o in state.overrides.items() if task != command.task}
    after = replace(state, n=decision.n, overrides=overrides)
    return Step(after, (decision,), decision)


def decide(state: DeciderState, task: str, decision_id: str, required: Seen, now: Stamp, timed_out: bool) -> Decision:
    """Return the next decision for ``task``. The gateway's preview calls this function on its read model.

    Raises
    ------
    InputsMissing
        An input that is ``required`` is missing, and ``timed_out`` is not set.
    UnknownThing, Conflict, Unavailable
        The study has no such task; the session has ended; there is no configuration or observation yet.
    """
    check_accepts(state.session, state.phase, Decide)
    missing = missing_inputs(state, required)
    study = _study(state, missing, timed_out)
    check_task(study, task)
    if missing.owners and not timed_out:
        raise InputsMissing(missing.owners, study.decider.wait_s, holding=_holding(state, required))
    if state.observation is None or state.config is None:
        raise Unavailable("the monitor has not published an observation of this session yet; ask again")
    triple = triple_of(state.observation, task)
    found = reductions(state.config.study)[triple]
    choice = _choose(state, study, task, triple, found, missing)
    choices = study.scoring.choices
    override = state.overrides.get(task)
    return Decision(
        session=state.session, stamp=now, seen=_seen(state), decision_id=decision_id, task=task, n=state.n + 1,
        strategy=choices[choice.action], observation=view(triple), scores=found.scores,
        cognitive_state=found.cognitive_state, suggested=choices[found.action], actions=list(choices),
        probabilities=choice.probabilities, propensity=choice.propensity, explored=choice.explored,
        policy_source=choice.source, stale=missing.observation, state=choice.state, seed=state.seed,
        versions=Versions(
            observation=state.observation.version,
            policy=state.policy.version if state.policy else 0,
            config=state.config.version,
        ),
        required=required if state.records_inputs else None,
        override_id=override.override_id if override else "", reason=override.reason if override else "",
        without_override=choices[choice.own] if override and state.records_own_choice else None,
        text=text_for(study.phrases, task, choices[choice.action]),
        **(_gaze_quality(state.observation.gaze, now) if state.records_gaze_quality else {}),
    )  # fmt: skip


def _gaze_quality(gaze: GazeView, now: Stamp) -> dict[str, float | None]:
    """Return the age of the gaze (s) and its share of valid samples (0..1); both are None without gaze."""
    if gaze.received is None:
        return {}
    return {"gaze_age_s": max(now.ns - gaze.received.ns, 0) / NS, "gaze_valid": gaze.valid}


def _holding(state: DeciderState, required: Seen) -> tuple[str, ...]:
    """Return the monitor if the gaze that is required may be in an observation that it holds back."""
    seen = state.observation
    if seen is not None and seen.version >= required.observation and covers_gaze(seen.seen, required):
        return ()
    return ("monitor",)


class Choice(NamedTuple):
    """The action of a decision, and how it was chosen."""

    action: int
    probabilities: list[float]
    propensity: float | None
    explored: bool
    source: PolicySource
    state: str
    own: int
    """The action that SHIFT chose; another than ``action`` only where a person overrode it."""


def _choose(
    state: DeciderState, study: Study, task: str, triple: Triple, found: Reduction, missing: MissingInputs
) -> Choice:
    actions = study.scoring.actions
    policy = state.policy
    if policy is None:
        name, greedy = found.cognitive_state, found.action
        row = [float(a == found.action) for a in range(len(actions))]
    else:
        name = found.cognitive_state if found.cognitive_state in policy.states else triple.name
        row = policy.states[name].probabilities
        values = policy.states[name].values
        greedy = values.index(max(values))
    row = with_minimum(row, study.decider.minimum_propensity)
    own = pick(row, uniform(state.seed, state.n + 1))
    if override := state.overrides.get(task):
        action = actions.index(tuple(override.strategy[s] for s in study.scoring.strategies))
        return Choice(action, row, None, False, "override", name, own)
    source: PolicySource = "scoring" if policy is None else "last_policy" if missing.policy else "learner"
    return Choice(own, row, row[own], own != greedy, source, name, own)


def with_minimum(row: list[float], minimum: float) -> list[float]:
    """Return the row mixed with the uniform one, so that each action has at least the probability ``minimum``.

    An action keeps the share 1 - n * minimum of its probability, where n is the number of actions.
    """
    if minimum <= 0:
        return row
    kept = max(0.0, 1 - len(row) * minimum)
    return [max(minimum, kept * p + minimum) for p in row]


# --- overrides ---


def _on_override(state: DeciderState, command: SetOverride, now: Stamp, timed_out: bool) -> Step[DeciderState]:
    check_accepts(state.session, state.phase, command)
    study = _study(state, missing_inputs(state, command.need), timed_out)
    check_task(study, command.task)
    if command.withdraws is None:
        check_strategy(study, command.strategy)
        strategy = {s: command.strategy[s] for s in study.scoring.strategies}
    else:
        _check_withdrawal(state, command)
        strategy = {}
    fact = Override(
        session=state.session, stamp=now, seen=_seen(state), override_id=command.command_id, task=command.task,
        strategy=strategy, reason=command.reason, withdraws=command.withdraws or "", author=command.author,
    )  # fmt: skip
    return Step(replace(state, overrides=overrides_after(state.overrides, fact)), (fact,), fact)


def overrides_after(overrides: Mapping[str, Override], fact: Override) -> dict[str, Override]:
    """Return the overrides that wait for a decision, by task, after another one or a withdrawal."""
    others = {task: waiting for task, waiting in overrides.items() if task != fact.task}
    return others if fact.withdraws else {**others, fact.task: fact}


def _check_withdrawal(state: DeciderState, command: SetOverride) -> None:
    """Raise an error unless the override that is withdrawn still waits for a decision of the task."""
    if command.strategy:
        rule = "give either a strategy, which replaces the override that waits, or withdraws"
        raise MalformedMessage(f"strategy: {rule}", (FieldError(field="strategy", value="", rule=rule),))
    waiting = state.overrides.get(command.task)
    if waiting is None or waiting.override_id != command.withdraws:
        instead = f"; {waiting.override_id} waits" if waiting else ""
        raise Conflict(
            f"override {command.withdraws} does not wait for a decision of task {command.task}: a decision used it, "
            f"another override replaced it, it was withdrawn, or it never was{instead}"
        )


def check_task(study: Study, task: str) -> None:
    """Raise :class:`UnknownThing` that names the study's tasks, unless ``task`` is one of them or any id is."""
    if study.tasks is not None and task not in study.tasks:
        known = ", ".join(study.tasks)
        meant = did_you_mean(task, study.tasks)
        raise UnknownThing(f"study {study.study} has no task {task!r}; it has {known}{meant}")


def check_strategy(study: Study, strategy: Strategy) -> None:
    """Raise :class:`MalformedMessage` unless each strategy of the study is given one of its levels."""
    errors = [
        FieldError(
            field=f"strategy.{name}",
            value=shorten(strategy.get(name, "")),
            rule=f"one of {', '.join(settings.levels)}{did_you_mean(strategy.get(name, ''), settings.levels)}",
        )
        for name, settings in study.scoring.strategies.items()
        if strategy.get(name) not in settings.levels
    ]
    errors += [
        FieldError(
            field=f"strategy.{shorten(name)}",
            value=shorten(strategy[name]),
            rule="no strategy of this study; "
            f"it has {', '.join(study.scoring.strategies)}{did_you_mean(name, study.scoring.strategies)}",
        )
        for name in strategy
        if name not in study.scoring.strategies
    ]
    if errors:
        raise MalformedMessage(f"{errors[0].field}: {errors[0].rule}", tuple(errors))


def _study(state: DeciderState, missing: MissingInputs, timed_out: bool) -> Study:
    if missing.config and not timed_out:
        raise InputsMissing(("recorder",), study_from_json(state.config.study).decider.wait_s if state.config else 2.0)
    if state.config is None:
        raise Unavailable("the recorder has not published a configuration of this session yet; ask again")
    return study_from_json(state.config.study)
