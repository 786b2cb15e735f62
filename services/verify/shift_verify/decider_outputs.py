"""The decider's recorded outputs, compared in their order with the outputs that its core derives. Pure.

Both ways of deriving them share this module: ``decider`` and ``decider_before_format_3`` find the state and the
input, and this module compares what follows with the recording.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NoReturn

from shift_decider.core import DeciderState, step
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Command, Decision, Estimate, Fact, Observation, Override, Policy, SetOverride

from shift_verify.difference import Differs, FactAtPlace, compare, differ, is_missing, name_of
from shift_verify.inputs import Inputs


class DeciderOutputs:
    """A position in the decider's recorded outputs.

    Parameters
    ----------
    inputs
        The facts that the decider read.
    outputs
        The decider's facts, in order and without a gap.
    following
        The fact after a gap, if there is one.
    """

    def __init__(self, inputs: Inputs, outputs: Sequence[FactAtPlace], following: FactAtPlace | None = None) -> None:
        self.inputs = inputs
        self.outputs = outputs
        self.following = following
        self.checked: Counter[str] = Counter()
        self.next = 0
        self.decisions = 0
        """The number of decisions before the position."""

    @property
    def target(self) -> FactAtPlace | None:
        """The next output; the fact after the gap, if the position is at the gap; or ``None``."""
        return self.following if self.at_gap else self.outputs[self.next]

    @property
    def at_gap(self) -> bool:
        """Whether no recorded output without a gap is left."""
        return self.next == len(self.outputs)

    @property
    def sequence(self) -> int:
        """The sequence number of the last output before the position."""
        return self.outputs[self.next - 1].sequence if self.next else 0

    @property
    def later(self) -> FactAtPlace | None:
        """The output after ``target``."""
        return self.outputs[self.next + 1] if self.next + 1 < len(self.outputs) else None

    def with_policy(self, state: DeciderState, target: FactAtPlace) -> DeciderState:
        """Return the state with the policy that ``target`` has seen. Raises :class:`Differs`, ``NotRecorded``."""
        n, before = target.fact.seen.policy, state.policy.version if state.policy else 0
        if n == before:
            return state
        if n < before:
            differ(target, "seen.policy", n, before)
        policy = self.inputs.get("policy", n, target)
        assert isinstance(policy, Policy)
        return step(state, policy, target.fact.stamp).state

    def compare_estimates(self, derived: Sequence[Fact], cause: str) -> None:
        """Compare the next outputs with the estimates of one input, and move on. Raises :class:`Differs`."""
        recorded = self.outputs[self.next : self.next + len(derived)]
        for i, (placed, fact) in enumerate(zip(recorded, derived, strict=False)):
            if _stands_for_later(recorded[i:], derived[i:]):
                is_missing(fact.subject, placed.sequence, placed.place, cause, fact)
            compare(placed, fact)
        if len(recorded) < len(derived) and (self.inputs.complete or self.following is not None):
            last = recorded[-1]
            is_missing(derived[0].subject, last.sequence + 1, last.place, cause, derived[len(recorded)])
        self._move_past(recorded)

    def compare_answer(self, state: DeciderState, target: FactAtPlace, commands: Iterable[Command]) -> DeciderState:
        """Compare a decision or an override with the answer to the first of ``commands`` that gives it.

        Return the state after it. Raise the difference from the answer to the first command if none gives it.
        """
        fact, first = target.fact, None
        if isinstance(fact, Decision) and fact.n != self.decisions + 1:
            differ(target, "n", fact.n, self.decisions + 1)
        for command in commands:
            try:
                after = step(state, command, fact.stamp, timed_out=True)
                compare(target, after.facts[0])
            except ShiftError as e:
                differ(target, "", fact.subject, None, f"the core refuses it: {e.detail}")
            except Differs as e:
                first = first or e
                continue
            self._move_past([target])
            return after.state
        assert first is not None
        raise first

    def _move_past(self, recorded: Sequence[FactAtPlace]) -> None:
        self.next += len(recorded)
        self.checked.update(placed.fact.subject for placed in recorded)
        self.decisions += sum(isinstance(placed.fact, Decision) for placed in recorded)

    def raise_lost(self, target: FactAtPlace, otherwise: str) -> NoReturn:
        """Raise which message is lost in the gap before ``target``: a decision by its number, else ``otherwise``."""
        numbers = self.inputs.numbered["decision"]
        claimed = max([self.inputs.claimed.get("decision", 0), *numbers])
        is_decision = self.decisions + 1 not in numbers and claimed > self.decisions
        why = f"number {self.sequence + 1} of the decider's messages is not in the recording"
        is_missing("decision" if is_decision else otherwise, self.sequence + 1, target.place, why)

    def raise_unreached(self, target: FactAtPlace, derived: Fact | None) -> NoReturn:
        """Raise that ``target`` cannot be the next output: an estimate is missing, or its ``seen`` is wrong.

        ``derived`` is the estimate that would have to be recorded before ``target``.
        """
        if (later := self.later) is not None:
            for field in ("observation", "config", "policy"):
                n, after = getattr(target.fact.seen, field), getattr(later.fact.seen, field)
                if after < n:
                    differ(target, f"seen.{field}", n, None, f"seen.{field} is {n}, and {after} in the next output")
        why = f"it must have been published before {name_of(target.fact.subject, target.sequence)}"
        is_missing("estimate", target.sequence, target.place, why, derived)


class DeciderDerivation:
    """A way of deriving the decider's outputs. Hand each observation to :meth:`take`, then call :meth:`end`."""

    def __init__(self, inputs: Inputs, outputs: DeciderOutputs) -> None:
        self.inputs = inputs
        self.outputs = outputs
        self.observed = 0

    @property
    def checked(self) -> Counter[str]:
        """The number of outputs that are as derived, by subject."""
        return self.outputs.checked

    def take(self, observation: Observation) -> None:
        """Derive the outputs up to the next observation. Raises :class:`Differs`, ``NotRecorded``."""
        raise NotImplementedError

    def end(self) -> None:
        """Derive the rest: no more observations follow. Raises :class:`Differs`, ``NotRecorded``."""
        self.derive_outputs()
        if not self.inputs.complete:
            return
        if (target := self.outputs.target) is not None:
            differ(target, "seen.observation", target.fact.seen.observation, self.observed)
        self.apply_rest()

    def derive_outputs(self) -> None:
        """Derive every output that has seen no more observations than were taken."""
        raise NotImplementedError

    def apply_rest(self) -> None:
        """Apply the inputs after the last output of a whole recording, and raise what they should have published."""
        raise NotImplementedError


def _stands_for_later(recorded: Sequence[FactAtPlace], derived: Sequence[Fact]) -> bool:
    """Return whether the first recorded output is one that follows the first derived one, which is then missing."""
    fact, seen = recorded[0].fact, recorded[0].fact.seen
    if not isinstance(fact, Estimate):
        return True
    if (seen.observation, seen.config) != (derived[0].seen.observation, derived[0].seen.config):
        return True
    return fact in derived[1:] and fact not in [placed.fact for placed in recorded[1:]]


def override_command(fact: Override) -> SetOverride:
    """Return the command that an override answers. What the caller required is not recorded and changes nothing."""
    return SetOverride(
        command_id=fact.override_id, session=fact.session, task=fact.task, strategy=fact.strategy, reason=fact.reason,
        withdraws=fact.withdraws or None, author=fact.author,
    )  # fmt: skip


def is_of_task(target: FactAtPlace, derived: Fact) -> bool:
    """Return whether ``target`` is an estimate of the same task as ``derived``."""
    fact = target.fact
    return isinstance(fact, Estimate) and isinstance(derived, Estimate) and fact.task == derived.task
