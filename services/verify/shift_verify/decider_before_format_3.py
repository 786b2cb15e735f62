"""Derive the decider's outputs of a session of format 1 or 2 again. Pure.

In these formats an estimate is published only where something changed, so the order in which the decider read
observations and configurations is not recorded between two outputs. It is searched for: a grid of the number of
configurations by the number of observations, in which a point is reached if some order leads there without an
estimate. What a decision required is not recorded either, and is searched for as well.
Policies change no estimate, and each output names the policy that was in force.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from shift_decider.core import DeciderState, step
from shift_schemas.messages import Command, Config, Decide, Decision, Estimate, Fact, Observation, Override, Seen

from shift_verify.decider_outputs import DeciderDerivation, DeciderOutputs, is_of_task, override_command
from shift_verify.difference import Differs, FactAtPlace, differ, is_missing
from shift_verify.inputs import Inputs

InputEdge = tuple[DeciderState, Observation | Config]
"""A state, and an input that leads on from it."""


class DeciderSearch(DeciderDerivation):
    """Estimates, decisions and overrides of a session of format 1 or 2, by a search for the order of its inputs."""

    def __init__(self, inputs: Inputs, outputs: DeciderOutputs) -> None:
        super().__init__(inputs, outputs)
        self.configured = 0
        self.latest: Observation | None = None
        self.unrecorded: Fact | None = None
        """An estimate that would follow from some order of the inputs, and that the outputs do not have there."""
        self.before: list[DeciderState | None] = []
        """The column before the latest observation, unless something was published after it."""
        self.column: list[DeciderState | None] = [step(None, inputs.session, inputs.session.stamp).state]
        """By the number of further configurations: the state that is reached without an output, or ``None``."""
        self._extend_column()

    def take(self, observation: Observation) -> None:
        """Derive the outputs up to the next observation. Raises :class:`Differs`, ``NotRecorded``."""
        self.derive_outputs()
        self.observed += 1
        self.latest = observation
        self.before, self.column = self.column, []
        for k, from_left in enumerate(self.before):
            transitions: list[InputEdge] = [(from_left, observation)] if from_left else []
            transitions += self._by_config(k)
            self.column.append(self._without_output(transitions))
        self.derive_outputs()

    def apply_rest(self) -> None:
        """Raise the estimate that the last inputs should have published."""
        if self.column[-1] is None and self.unrecorded is not None:
            is_missing("estimate", self.outputs.sequence + 1, 2**62, "the last inputs change one", self.unrecorded)

    # --- the grid ---

    def _extend_column(self) -> None:
        """Extend the column by the configurations that the next output has seen and that publish nothing."""
        target = self.outputs.target
        wanted = target.fact.seen.config if target else self.inputs.last("config")
        for k in range(len(self.column), wanted - self.configured + 1):
            if self.configured + k not in self.inputs.numbered["config"]:
                break
            self.column.append(None)
            self.column[k] = self._without_output(self._by_config(k))

    def _by_config(self, k: int) -> list[InputEdge]:
        """Return the transition to row ``k`` of the column by its configuration, if there is one."""
        below = self.column[k - 1] if k else None
        config = self.inputs.numbered["config"].get(self.configured + k)
        return [(below, config)] if below is not None and isinstance(config, Config) else []

    def _without_output(self, transitions: list[InputEdge]) -> DeciderState | None:
        """Return the state after the first of ``transitions`` that publishes nothing."""
        for state, given in transitions:
            after = step(state, given, given.stamp)
            if not after.facts:
                return after.state
            self.unrecorded = after.facts[0]
        return None

    # --- an output ---

    def derive_outputs(self) -> None:
        """Derive every output that has seen no more observations than were taken."""
        while (target := self.outputs.target) is not None and target.fact.seen.observation <= self.observed:
            k = self._row(target)
            if self.outputs.at_gap:
                self.outputs.raise_lost(target, "override" if self._is_next(target, k) else "estimate")
            state = self._estimated(target, k) if isinstance(target.fact, Estimate) else self._answered(target, k)
            self.configured += k
            self.before, self.column, self.unrecorded = [], [state], None
            self._extend_column()

    def _row(self, target: FactAtPlace) -> int:
        seen = target.fact.seen
        if seen.observation < self.observed:
            differ(target, "seen.observation", seen.observation, self.observed)
        if seen.config < self.configured:
            differ(target, "seen.config", seen.config, self.configured)
        if seen.config > self.configured:
            self.inputs.get("config", seen.config, target)
        return seen.config - self.configured

    def _transitions(self, k: int) -> list[InputEdge]:
        """Return the last inputs that can have led to row ``k``, each with the state before it."""
        transitions = self._by_config(k)
        if self.latest is not None and k < len(self.before) and (from_left := self.before[k]) is not None:
            transitions.append((from_left, self.latest))
        return transitions

    def _estimated(self, target: FactAtPlace, k: int) -> DeciderState:
        """Return the state after the last input before ``target``, which is the first of its estimates."""
        first: Differs | None = None
        for state, given in self._transitions(k):
            try:
                return self._compared(target, self.outputs.with_policy(state, target), given)
            except Differs as e:
                first = first or e
        if first is None:
            self.outputs.raise_unreached(target, self.unrecorded)
        raise first

    def _compared(self, target: FactAtPlace, state: DeciderState, given: Observation | Config) -> DeciderState:
        after = step(state, given, target.fact.stamp)
        if not after.facts:
            differ(target, "", target.fact.subject, None, f"nothing changed with {given.subject} {given.version}")
        self.outputs.compare_estimates(after.facts, f"{given.subject} {given.version} changes it")
        return after.state

    def _answered(self, target: FactAtPlace, k: int) -> DeciderState:
        """Return the state after a decision or an override."""
        reached = self.column[k] if k < len(self.column) else None
        if reached is None:
            self.outputs.raise_unreached(target, self.unrecorded)
        state = self.outputs.with_policy(reached, target)
        return self.outputs.compare_answer(state, target, _commands(target.fact, state, self.inputs))

    def _is_next(self, target: FactAtPlace, k: int) -> bool:
        """Return whether ``target`` can be the next output, apart from the answer to a command."""
        if not isinstance(target.fact, Estimate):
            return k < len(self.column) and self.column[k] is not None
        published = (step(state, given, target.fact.stamp).facts for state, given in self._transitions(k))
        return any(facts and is_of_task(target, facts[0]) for facts in published)


def _commands(fact: Fact, state: DeciderState, inputs: Inputs) -> Iterator[Command]:
    """Yield the commands that ``fact`` can be the answer to."""
    if isinstance(fact, Override):
        yield override_command(fact)
        return
    assert isinstance(fact, Decision)
    for required in _possible_requirements(state, inputs):
        yield Decide(command_id=fact.decision_id, session=fact.session, task=fact.task, need=required)


def _possible_requirements(state: DeciderState, inputs: Inputs) -> Iterator[Seen]:
    """Yield what can have been required: nothing, or inputs that were missing then and that the recording has."""
    seen = [x.seen for x in (state.policy, state.observation) if x is not None]
    performances = {0} | {s.performance + 1 for s in seen if s.performance < inputs.last("performance")}
    configs = {0} | {s.config + 1 for s in seen if s.config < inputs.last("config")}
    gazes: list[dict[str, int]] = [{}]
    if inputs.gaze and state.observation is not None:
        known = state.observation.seen.gaze or {"any": -1}
        gazes.append({source: n + 1 for source, n in known.items()})
    for performance, config, gaze in product(sorted(performances), sorted(configs), gazes):
        yield Seen(performance=performance, config=config, gaze=gaze)
