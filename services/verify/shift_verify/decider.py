"""The decider's outputs derived again, through its own core, from what it took in. Pure.

It puts out an estimate only where something changed, so the order in which it took observations and
configurations is not written down between two outputs. It is found: a grid of how many configurations
by how many observations, in which a point is reached when some order leads there without an estimate.
Policies change no estimate, and each output names the one that was in force.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product

from shift_decider.core import DeciderState, step
from shift_schemas.errors import ShiftError
from shift_schemas.messages import (
    Command,
    Config,
    Decide,
    Decision,
    Estimate,
    Fact,
    Observation,
    Override,
    Policy,
    Seen,
    SetOverride,
)

from shift_verify.difference import Differs, Placed, compare, differ, is_missing, name_of
from shift_verify.monitor_learner import Inputs

Way = tuple[DeciderState, Observation | Config]
"""A state, and the input that leads on from it."""


class Redecide:
    """Estimates, decisions and overrides. Hand each observation to :meth:`take`, then :meth:`end`.

    Parameters
    ----------
    outputs
        The decider's facts, in order and without a gap.
    following
        The fact after a gap, where there is one.
    """

    def __init__(self, inputs: Inputs, outputs: Sequence[Placed], following: Placed | None = None) -> None:
        self.inputs = inputs
        self.outputs = outputs
        self.following = following
        self.checked: Counter[str] = Counter()
        self.next = 0
        self.observed = self.configured = self.n = 0
        self.latest: Observation | None = None
        self.unwritten: Fact | None = None
        """An estimate that follows somewhere on the way, and that the outputs do not have there."""
        start = step(None, inputs.session, inputs.session.stamp).state
        self.before: list[DeciderState | None] = []
        """The column before the latest observation, until something was put out after it."""
        self.column: list[DeciderState | None] = [start]
        """Per number of further configurations: the state that is reached in silence, or none."""
        self._widen()

    @property
    def _target(self) -> Placed | None:
        return self.outputs[self.next] if self.next < len(self.outputs) else self.following

    def take(self, observation: Observation) -> None:
        """The monitor's next observation. Raises :class:`Differs` and ``NotRecorded``."""
        self._settle()
        self.observed += 1
        self.latest = observation
        self.before, self.column = self.column, []
        for k, from_left in enumerate(self.before):
            ways: list[Way] = [(from_left, observation)] if from_left else []
            ways += self._by_config(k)
            self.column.append(self._in_silence(ways))
        self._settle()

    def end(self) -> None:
        """No more observations come: of a whole recording, every output must be explained by now."""
        self._settle()
        if not self.inputs.complete:
            return
        if (target := self._target) is not None:
            differ(target, "seen.observation", target.fact.seen.observation, self.observed)
        if self.column[-1] is None and self.unwritten is not None:
            is_missing("estimate", self._sequence + 1, 2**62, "the last inputs change one", self.unwritten)

    # --- the grid ---

    def _widen(self) -> None:
        """Make the column as long as the next output has seen configurations, all without a word."""
        target = self._target
        wanted = target.fact.seen.config if target else self.inputs.last("config")
        for k in range(len(self.column), wanted - self.configured + 1):
            if self.configured + k not in self.inputs.numbered["config"]:
                break
            self.column.append(None)
            self.column[k] = self._in_silence(self._by_config(k))

    def _by_config(self, k: int) -> list[Way]:
        """The way to row ``k`` of the column by its configuration."""
        below = self.column[k - 1] if k else None
        config = self.inputs.numbered["config"].get(self.configured + k)
        return [(below, config)] if below is not None and isinstance(config, Config) else []

    def _in_silence(self, ways: list[Way]) -> DeciderState | None:
        for state, given in ways:
            after = step(state, given, given.stamp)
            if not after.facts:
                return after.state
            self.unwritten = after.facts[0]
        return None

    # --- an output ---

    def _settle(self) -> None:
        """Derive every output that has seen no more observations than were taken."""
        while (target := self._target) is not None and target.fact.seen.observation <= self.observed:
            k = self._row(target)
            if self.next == len(self.outputs):
                self._gap(target, k)
            state = self._estimated(target, k) if isinstance(target.fact, Estimate) else self._answered(target, k)
            self.configured += k
            self.before, self.column, self.unwritten = [], [state], None
            self._widen()

    def _row(self, target: Placed) -> int:
        seen = target.fact.seen
        if seen.observation < self.observed:
            differ(target, "seen.observation", seen.observation, self.observed)
        if seen.config < self.configured:
            differ(target, "seen.config", seen.config, self.configured)
        if seen.config > self.configured:
            self.inputs.get("config", seen.config, target)
        return seen.config - self.configured

    def _ways(self, k: int) -> list[Way]:
        """The ways on which the last input before row ``k`` can have come."""
        ways = self._by_config(k)
        if self.latest is not None and k < len(self.before) and (from_left := self.before[k]) is not None:
            ways.append((from_left, self.latest))
        return ways

    def _estimated(self, target: Placed, k: int) -> DeciderState:
        """The state after the last input before ``target``, which is the first of its estimates."""
        first: Differs | None = None
        for state, given in self._ways(k):
            try:
                return self._compared(target, self._with_policy(state, target), given)
            except Differs as e:
                first = first or e
        raise first or self._unreached(target)

    def _compared(self, target: Placed, state: DeciderState, given: Observation | Config) -> DeciderState:
        after = step(state, given, target.fact.stamp)
        if not after.facts:
            differ(target, "", target.fact.subject, None, f"nothing changed with {given.subject} {given.version}")
        recorded = self.outputs[self.next : self.next + len(after.facts)]
        for placed, derived in zip(recorded, after.facts, strict=False):
            compare(placed, derived)
        if len(recorded) < len(after.facts) and (self.inputs.complete or self.following is not None):
            rest = after.facts[len(recorded)]
            is_missing("estimate", recorded[-1].sequence + 1, target.place, f"{given.subject} changes it", rest)
        self._passed(recorded)
        return after.state

    def _answered(self, target: Placed, k: int) -> DeciderState:
        """The state after a decision or an override."""
        fact, first = target.fact, None
        assert isinstance(fact, Decision | Override)
        if isinstance(fact, Decision) and fact.n != self.n + 1:
            differ(target, "n", fact.n, self.n + 1)
        reached = self.column[k] if k < len(self.column) else None
        if reached is None:
            raise self._unreached(target)
        state = self._with_policy(reached, target)
        for command in _commands(fact, state, self.inputs):
            try:
                after = step(state, command, fact.stamp, timed_out=True)
                compare(target, after.facts[0])
            except ShiftError as e:
                differ(target, "", fact.subject, None, f"the core refuses it: {e.detail}")
            except Differs as e:
                first = first or e
                continue
            self._passed([target])
            return after.state
        assert first is not None
        raise first

    def _with_policy(self, state: DeciderState, target: Placed) -> DeciderState:
        n, before = target.fact.seen.policy, state.policy.version if state.policy else 0
        if n == before:
            return state
        if n < before:
            differ(target, "seen.policy", n, before)
        policy = self.inputs.get("policy", n, target)
        assert isinstance(policy, Policy)
        return step(state, policy, target.fact.stamp).state

    def _passed(self, recorded: Sequence[Placed]) -> None:
        self.next += len(recorded)
        self.checked.update(placed.fact.subject for placed in recorded)
        self.n += sum(isinstance(placed.fact, Decision) for placed in recorded)

    # --- what is not there ---

    @property
    def _sequence(self) -> int:
        return self.outputs[self.next - 1].sequence if self.next else 0

    def _unreached(self, target: Placed) -> Differs:
        """An estimate on the way to ``target`` is not in the recording; or ``target`` has not seen what it says."""
        later = self.outputs[self.next + 1 : self.next + 2]
        for field in ("observation", "config", "policy"):
            n = getattr(target.fact.seen, field)
            if any(getattr(placed.fact.seen, field) < n for placed in later):
                differ(target, f"seen.{field}", n, None, f"seen.{field} is {n}, and of what follows it less")
        why = f"it must have been put out before {name_of(target.fact.subject, target.sequence)}"
        try:
            is_missing("estimate", target.sequence, target.place, why, self.unwritten)
        except Differs as e:
            return Differs(e.place, e.difference)

    def _gap(self, target: Placed, k: int) -> None:
        """Say what is lost before ``target``: a decision has a number, an estimate is derived, else an override."""
        decisions = self.inputs.numbered["decision"]
        claimed = max([self.inputs.claimed.get("decision", 0), *decisions])
        if self.n + 1 not in decisions and claimed > self.n:
            subject = "decision"
        else:
            subject = "override" if self._follows(target, k) else "estimate"
        why = f"number {self._sequence + 1} of the decider's messages is not in the recording"
        is_missing(subject, self._sequence + 1, target.place, why)

    def _follows(self, target: Placed, k: int) -> bool:
        """Whether ``target`` can be the next thing that was put out, but for a command."""
        if not isinstance(target.fact, Estimate):
            return k < len(self.column) and self.column[k] is not None
        firsts = [after.facts[0] for s, given in self._ways(k) if (after := step(s, given, target.fact.stamp)).facts]
        return any(isinstance(f, Estimate) and f.task == target.fact.task for f in firsts)


def _commands(fact: Decision | Override, state: DeciderState, inputs: Inputs) -> Iterator[Command]:
    """What may have been asked: what the door needed is not recorded, only whether it was there."""
    if isinstance(fact, Override):
        yield SetOverride(
            command_id=fact.override_id, session=fact.session, task=fact.task, strategy=fact.strategy,
            reason=fact.reason,
        )  # fmt: skip
        return
    for need in _needs(state, inputs):
        yield Decide(command_id=fact.decision_id, session=fact.session, task=fact.task, need=need)


def _needs(state: DeciderState, inputs: Inputs) -> Iterator[Seen]:
    """Nothing; or something that was not there yet then, and that the recording has: so it can have been asked for."""
    seen = [x.seen for x in (state.policy, state.observation) if x is not None]
    performances = {0} | {s.performance + 1 for s in seen if s.performance < inputs.last("performance")}
    configs = {0} | {s.config + 1 for s in seen if s.config < inputs.last("config")}
    gazes: list[dict[str, int]] = [{}]
    if inputs.gaze and state.observation is not None:
        known = state.observation.seen.gaze or {"any": -1}
        gazes.append({source: n + 1 for source, n in known.items()})
    for performance, config, gaze in product(sorted(performances), sorted(configs), gazes):
        yield Seen(performance=performance, config=config, gaze=gaze)
