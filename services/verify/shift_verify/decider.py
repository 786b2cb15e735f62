"""Derive the decider's outputs again through its own core, from the inputs that it read. Pure.

From format 3 on this is a fold. A configuration publishes an estimate for every task, so between two outputs the
decider read either observations alone or observations and then one configuration, and ``seen`` says how many.
Before the first observation a configuration publishes nothing, and its order among the silent inputs has no effect.
A policy changes no estimate, and each output names the policy that was in force.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from shift_decider.core import DeciderState, step
from shift_schemas.messages import Command, Config, Decide, Decision, Estimate, Fact, Observation, Override, Seen

from shift_verify.decider_before_format_3 import DeciderSearch
from shift_verify.decider_outputs import DeciderDerivation, DeciderOutputs, is_of_task, override_command
from shift_verify.difference import FactAtPlace, differ, is_missing
from shift_verify.inputs import Inputs

FIRST_FORMAT_OF_FOLD = 3
"""The first format in which the outputs record the order of the inputs, and a decision what it required."""


def decider_verification(
    inputs: Inputs, outputs: Sequence[FactAtPlace], following: FactAtPlace | None = None
) -> DeciderDerivation:
    """Return the verification for the format of the session; see :class:`DeciderOutputs` for the parameters."""
    kind = DeciderFold if inputs.session.format >= FIRST_FORMAT_OF_FOLD else DeciderSearch
    return kind(inputs, DeciderOutputs(inputs, outputs, following))


class DeciderFold(DeciderDerivation):
    """Estimates, decisions and overrides of a session of format 3 or later, as a fold over its inputs."""

    def __init__(self, inputs: Inputs, outputs: DeciderOutputs) -> None:
        super().__init__(inputs, outputs)
        self.state: DeciderState = step(None, inputs.session, inputs.session.stamp).state
        self._stopped = False
        self._latest_required: FactAtPlace | None = None
        """The decision that required the latest observation."""

    @property
    def configured(self) -> int:
        """The version of the configuration that was applied last."""
        return self.state.config.version if self.state.config else 0

    def take(self, observation: Observation) -> None:
        """Derive the outputs up to the next observation. Raises ``Differs``, ``NotRecorded``."""
        self.derive_outputs()
        if self.observed == 0:
            self._apply_first_configs()
        self.observed += 1
        self._apply(observation)
        self.derive_outputs()

    def apply_rest(self) -> None:
        """Apply the last configurations, and check the latest requirement."""
        for version in range(self.configured + 1, self.inputs.last("config") + 1):
            self._apply(self.inputs.numbered["config"][version])
        if (latest := self._latest_required) is not None:
            self._check_required(latest, "observation", self.observed)

    # --- inputs ---

    def _apply_first_configs(self) -> None:
        """Apply the configurations that were read before the first observation: those that its estimates have seen."""
        target = self.outputs.target
        if target is not None and target.fact.seen.observation == 1:
            while self.configured < target.fact.seen.config:
                self._apply(self._next_config(target))

    def _next_config(self, target: FactAtPlace) -> Fact:
        return self.inputs.get("config", self.configured + 1, target)

    def _apply(self, given: Fact) -> None:
        """Apply an input, and compare the estimates that it publishes with the next outputs."""
        if self._stopped:
            return
        after = step(self.state, given, given.stamp)
        if after.facts:
            self._compare_estimates(given, after.facts[0])
        else:
            self.state = after.state

    def _compare_estimates(self, given: Fact, first: Fact) -> None:
        """Compare the outputs with the estimates that ``given`` publishes; ``first`` is the first of them."""
        assert isinstance(given, Observation | Config)
        cause = f"it follows from {given.subject} {given.version}"
        target = self.outputs.target
        if target is None:
            if self.inputs.complete:
                is_missing(first.subject, self.outputs.sequence + 1, 2**62, cause, first)
            self._stopped = True
            return
        if self.outputs.at_gap:
            is_next = self._is_first_of(target, first) and is_of_task(target, first)
            self.outputs.raise_lost(target, "override" if is_next else "estimate")
        if not self._is_first_of(target, first):
            self._raise_unexpected(target, given, first)
        state = self.outputs.with_policy(self.state, target)
        after = step(state, given, target.fact.stamp)
        self.outputs.compare_estimates(after.facts, cause)
        self.state = after.state

    def _is_first_of(self, target: FactAtPlace, first: Fact) -> bool:
        """Return whether ``target`` is recorded as the first estimate of the input that publishes ``first``."""
        seen = target.fact.seen
        is_seen = (seen.observation, seen.config) == (first.seen.observation, first.seen.config)
        return is_seen and isinstance(target.fact, Estimate)

    def _raise_unexpected(self, target: FactAtPlace, given: Observation | Config, first: Fact) -> NoReturn:
        """Raise why ``target`` stands where ``first`` should: its ``seen`` is wrong, or ``first`` is missing."""
        field = f"seen.{given.subject}"
        recorded = getattr(target.fact.seen, given.subject)
        if is_of_task(target, first):
            update = {"seen": first.seen, "stamp": first.stamp}
            if target.fact.model_copy(update=update) == first:
                differ(target, field, recorded, given.version)
        later = self.outputs.later
        if later is not None and self._is_first_of(later, first) and is_of_task(later, first):
            differ(target, field, recorded, given.version - 1)
        self.outputs.raise_unreached(target, first)

    # --- outputs ---

    def derive_outputs(self) -> None:
        """Derive every output that has seen no more observations than were applied."""
        while not self._stopped and (target := self.outputs.target) is not None:
            seen = target.fact.seen
            _check_versions(target)
            if seen.observation > self.observed:
                return
            if seen.observation < self.observed:
                differ(target, "seen.observation", seen.observation, self.observed)
            if seen.config < self.configured:
                differ(target, "seen.config", seen.config, self.configured)
            if seen.config > self.configured:
                self._apply(self._next_config(target))
            else:
                self._derive_answer(target)

    def _derive_answer(self, target: FactAtPlace) -> None:
        """Derive a decision or an override: every estimate of the inputs so far has been compared already."""
        fact = target.fact
        if self.outputs.at_gap:
            self.outputs.raise_lost(target, "estimate" if isinstance(fact, Estimate) else "override")
        if isinstance(fact, Estimate):
            why = f"no estimate follows from observation {self.observed} and config {self.configured}"
            differ(target, "", fact.subject, None, why)
        state = self.outputs.with_policy(self.state, target)
        self.state = self.outputs.compare_answer(state, target, [self._command(target)])

    def _command(self, target: FactAtPlace) -> Command:
        fact = target.fact
        if isinstance(fact, Override):
            return override_command(fact)
        if not isinstance(fact, Decision):
            differ(target, "", fact.subject, None, f"verify does not know how the decider makes a {fact.subject}")
        if fact.required is None:
            differ(target, "required", None, Seen().model_dump(mode="json"), "it does not record what it required")
        limits = {"decision": self.outputs.decisions}
        if self.inputs.complete:
            limits |= {subject: self.inputs.last(subject) for subject in ("performance", "config", "policy")}
        for subject, most in limits.items():
            self._check_required(target, subject, most)
        latest = self._latest_required
        if latest is None or fact.required.observation > _required(latest).observation:
            self._latest_required = target
        return Decide(command_id=fact.decision_id, session=fact.session, task=fact.task, need=fact.required)

    def _check_required(self, target: FactAtPlace, subject: str, most: int) -> None:
        """Raise :class:`Differs` if ``target`` required more than there was: nobody can have been told of it."""
        n = getattr(_required(target), subject)
        if n > most:
            differ(target, f"required.{subject}", n, most, f"it required {subject} {n}, and there were {most}")


def _check_versions(target: FactAtPlace) -> None:
    """Raise :class:`Differs` if the ``versions`` of a decision do not repeat what it has ``seen``."""
    if not isinstance(target.fact, Decision):
        return
    for subject in ("observation", "config", "policy"):
        seen, version = getattr(target.fact.seen, subject), getattr(target.fact.versions, subject)
        if seen != version:
            why = f"seen.{subject} is {seen} and versions.{subject} is {version}; they must be equal"
            differ(target, f"versions.{subject}", version, seen, why)


def _required(target: FactAtPlace) -> Seen:
    assert isinstance(target.fact, Decision)
    assert target.fact.required is not None
    return target.fact.required
