"""The learner's core as a fold over a session, compared with a naive loop and across restarts."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_learner import core
from shift_learner.core import LearnerState
from shift_learner.learners import learner_named
from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Conflict, InvalidStudy, ShiftError, Unavailable, UnknownThing
from shift_schemas.messages import (
    FORMAT,
    Config,
    Decision,
    Fact,
    Performance,
    Policy,
    ReportPerformance,
    Result,
    Seen,
    Session,
    Transition,
    Versions,
)
from shift_schemas.timestamps import Stamp
from shift_study.loading import study_json, study_of
from shift_study.scoring import reduce, view
from shift_study.study import Study

NOW = Stamp(sec=1_700_000_000, nsec=0)
FOCUSED = Triple("high", "focused", "unknown")
ACTIONS = Study(study="x").scoring.actions


def session(state: Any = "live") -> Session:
    """Return the session fact in one of its states."""
    return Session(
        session="s1", stamp=NOW, participant="P01", study="x", seed=7, state=state, started=NOW, format=FORMAT
    )  # fmt: skip


def config(version: int = 1, **learner: Any) -> Config:
    """Return a configuration with these settings of the learner."""
    return Config(
        session="s1", stamp=NOW, version=version, study=study_json(study_of({"study": "x", "learner": learner}))
    )


def decision(n: int, action: int = 0, triple: Triple = FOCUSED, overridden: bool = False) -> Decision:
    """Return the ``n``-th decision."""
    scoring = Study(study="x").scoring
    found = reduce(scoring, triple)
    return Decision(
        session="s1", stamp=NOW, decision_id=f"d{n}", task="grasp", n=n, strategy=scoring.strategy(ACTIONS[action]),
        observation=view(triple), scores=found.scores, cognitive_state=found.cognitive_state,
        suggested=scoring.strategy(ACTIONS[found.action]), actions=[scoring.strategy(a) for a in ACTIONS],
        probabilities=[1 / 6] * 6, propensity=None if overridden else 1 / 6, explored=False,
        policy_source="override" if overridden else "learner", stale=False, state=found.cognitive_state, seed=7,
        versions=Versions(observation=n, policy=n, config=1),
    )  # fmt: skip


def report(n: int, understood: bool = True, able: bool = True, seconds: float = 5.0, **need: int) -> ReportPerformance:
    """Return the report of the ``n``-th decision."""
    return ReportPerformance(
        command_id=f"d{n}", session="s1", need=Seen(**need),
        comprehension=Result(success=understood, duration_s=seconds),
        enabledness=Result(success=able, duration_s=seconds),
    )  # fmt: skip


def folded(*messages: Any) -> tuple[LearnerState, list[Fact]]:
    """Return the state after these messages, and all facts."""
    state: LearnerState | None = None
    facts: list[Fact] = []
    for message in messages:
        step = core.step(state, message, NOW)
        state = step.state
        facts += step.facts
    assert state is not None
    return state, facts


def configured_session(**learner: Any) -> LearnerState:
    """Return the state of a session that has its configuration."""
    return folded(session(), config(**learner))[0]


def of_kind(facts: Any, kind: Any) -> Any:
    """Return the only fact of this kind."""
    (found,) = [f for f in facts if isinstance(f, kind)]
    return found


# --- a policy after each input, for one decision number ---


def test_configuration_publishes_the_first_policy_for_decision_1() -> None:
    _, facts = folded(session(), config())
    policy = of_kind(facts, Policy)
    assert (policy.version, policy.for_n, policy.epsilon, policy.cumulative_reward) == (1, 1, 0.75, 0.0)
    assert policy.seen == Seen(config=1)
    assert list(policy.states) == list(Study(study="x").scoring.states)
    assert policy.states["engaged_observer"].probabilities == [0.75 / 6 + 0.25, *[0.75 / 6] * 5]
    assert [tuple(a.values()) for a in policy.actions] == list(ACTIONS)


def test_each_decision_and_each_report_publishes_a_policy_with_its_inputs() -> None:
    state = configured_session()
    for message, for_n, seen in (
        (decision(1), 2, Seen(decision=1, config=1)),
        (report(1), 2, Seen(decision=1, performance=1, config=1)),
        (decision(2), 3, Seen(decision=2, performance=1, config=1)),
        (config(2, epsilon=0.5), 3, Seen(decision=2, performance=1, config=2)),
    ):
        step = core.step(state, message, NOW)
        policy = of_kind(step.facts, Policy)
        assert (policy.for_n, policy.seen, policy.version) == (for_n, seen, state.version + 1)
        assert step.facts[-1] is policy
        state = step.state
    assert policy.epsilon == 0.5 * 0.98


def test_report_publishes_performance_transition_and_policy() -> None:
    state, _ = folded(session(), config(), decision(1, action=2))
    step = core.step(state, report(1, understood=True, able=False, seconds=5.0), NOW)
    performance, transition, policy = step.facts
    assert isinstance(performance, Performance)
    assert isinstance(transition, Transition)
    assert isinstance(policy, Policy)
    assert performance.comprehension.value == exp(-0.5) == -performance.enabledness.value
    assert (performance.n, performance.task, performance.reward, performance.cumulative_reward) == (
        1,
        "grasp",
        0.0,
        0.0,
    )
    assert step.result is performance
    assert transition.state == "engaged_observer"
    assert tuple(transition.action.values()) == ACTIONS[2]
    assert (transition.reward, transition.propensity, transition.versions) == (0.0, 1 / 6, decision(1).versions)
    assert transition.value == policy.states["engaged_observer"].values[2]


def test_rewards_add_up() -> None:
    state, _ = folded(session(), config(), decision(1), report(1, seconds=0.0), decision(2))
    step = core.step(state, report(2, understood=False, able=False, seconds=0.0), NOW)
    performance = of_kind(step.facts, Performance)
    assert (performance.n, performance.reward, performance.cumulative_reward) == (2, -1.0, 0.0)
    assert of_kind(step.facts, Policy).cumulative_reward == 0.0


def test_override_counts_as_taken_is_learned_and_has_no_propensity() -> None:
    state, facts = folded(session(), config(), decision(1, action=3, overridden=True))
    row = of_kind(facts[-1:], Policy).states["unfocused"]
    assert row.probabilities[3] == pytest.approx(1 - 0.75 * 0.99), "an action that was taken has the greedy part only"
    step = core.step(state, report(1, seconds=0.0), NOW)
    transition = of_kind(step.facts, Transition)
    assert transition.propensity is None
    assert transition.value == 0.25
    assert of_kind(step.facts, Policy).states["engaged_observer"].visits == [0, 0, 0, 1, 0, 0]


# --- refused reports ---


def test_report_without_its_decision_waits_for_the_decider_and_is_then_refused() -> None:
    with pytest.raises(InputsMissing) as waiting:
        core.step(configured_session(), report(1), NOW)
    assert waiting.value.owners == ("decider",)
    with pytest.raises(UnknownThing, match="no decision d1"):
        core.step(configured_session(), report(1), NOW, timed_out=True)


def test_learner_that_lacks_inputs_is_unavailable_instead_of_refusing() -> None:
    with pytest.raises(InputsMissing):
        core.step(configured_session(), report(1, decision=1), NOW)
    with pytest.raises(Unavailable, match="decider"):
        core.step(configured_session(), report(1, decision=1), NOW, timed_out=True)
    bare, _ = folded(session())
    with pytest.raises(InputsMissing) as waiting:
        core.step(bare, report(1), NOW)
    assert waiting.value.owners == ("recorder", "decider")
    with pytest.raises(Unavailable, match="recorder"):
        core.step(bare, report(1), NOW, timed_out=True)


def test_report_waits_for_the_configuration_that_was_answered_before_it() -> None:
    state, _ = folded(session(), config(), decision(1))
    with pytest.raises(InputsMissing) as waiting:
        core.step(state, report(1, config=2), NOW)
    assert waiting.value.owners == ("recorder",)
    assert core.step(state, report(1, config=2), NOW, timed_out=True).facts


def test_correction_waits_for_the_configuration_that_was_answered_before_it() -> None:
    state, _ = folded(session(), config(), decision(1), report(1))
    with pytest.raises(InputsMissing) as waiting:
        core.step(state, correction(1, understood=False, config=2), NOW)
    assert waiting.value.owners == ("recorder",)
    paused = core.step(state, config(2, paused=True), NOW).state
    facts = core.step(paused, correction(1, understood=False, config=2), NOW).facts
    assert not [f for f in facts if isinstance(f, Transition)], "the learner is paused"


def test_report_without_a_session_or_after_its_end_is_refused() -> None:
    with pytest.raises(UnknownThing):
        core.step(None, report(1), NOW)
    state, _ = folded(session(), config(), decision(1), session("ending"))
    with pytest.raises(Conflict, match="has ended"):
        core.step(state, report(1), NOW)


def test_second_report_of_a_decision_is_refused() -> None:
    state, _ = folded(session(), config(), decision(1), report(1))
    with pytest.raises(UnknownThing):
        core.step(state, report(1), NOW, timed_out=True)
    waiting, _ = folded(session(), config(discount=0.5), decision(1), report(1))
    with pytest.raises(Conflict, match="has its performance already"):
        core.step(waiting, report(1), NOW)


def test_decision_before_the_configuration_is_unavailable() -> None:
    bare, _ = folded(session())
    with pytest.raises(Unavailable):
        core.step(bare, decision(1), NOW)


def test_unknown_learner_is_refused_and_the_learners_are_listed() -> None:
    with pytest.raises(InvalidStudy, match="there is no learner 'deep'; write one of "):
        learner_named("deep")


# --- a discount above 0 ---


def test_transition_with_a_discount_waits_for_the_next_decision() -> None:
    state, _ = folded(session(), config(discount=0.5), decision(1, action=0))
    step = core.step(state, report(1, seconds=0.0), NOW)
    assert [type(f) for f in step.facts] == [Performance, Policy]
    assert of_kind(step.facts, Policy).states["engaged_observer"].values[0] == 1.0, "nothing is learned yet"
    after = core.step(step.state, decision(2, triple=Triple("low", "distracted", "failure")), NOW)
    assert [type(f) for f in after.facts] == [Transition, Policy]
    assert of_kind(after.facts, Transition).decision_id == "d1"
    assert of_kind(after.facts, Transition).value == 1.0 + 0.25 * (1.0 + 0.5 * 1.0 - 1.0)


def test_waiting_report_is_learned_at_the_end_of_the_session() -> None:
    state, _ = folded(session(), config(discount=0.5), decision(1, action=1), report(1, seconds=0.0))
    step = core.step(state, session("ending"), NOW)
    assert [type(f) for f in step.facts] == [Transition, Policy]
    assert of_kind(step.facts, Transition).value == 0.25
    assert core.step(step.state, session("ended"), NOW).facts == ()


def test_end_of_a_session_without_waiting_reports_publishes_nothing() -> None:
    state, _ = folded(session(), config(), decision(1), report(1))
    assert core.step(state, session("ending"), NOW).facts == ()


def test_next_state_is_remembered_if_its_own_report_comes_first() -> None:
    low = Triple("low", "distracted", "failure")
    messages = (session(), config(discount=0.5), decision(1), decision(2, action=1, triple=low), decision(3))
    state, _ = folded(*messages, report(2, understood=False, able=False, seconds=0.0))
    values = core.step(state, report(1, seconds=0.0), NOW)
    following = of_kind(core.step(state, decision(4), NOW).facts, Policy).states["overwhelmed_struggler"].values
    assert following[1] < 1.0, "d2 was a failure"
    assert of_kind(values.facts, Transition).value == 1.0 + 0.25 * (1.0 + 0.5 * max(following) - 1.0)


# --- against a naive loop, and across restarts ---


@dataclass
class Naive:
    """The same session as a naive loop."""

    rate: float
    discount: float
    table: list[list[float]]
    states: list[int] = field(default_factory=list)
    actions: list[int] = field(default_factory=list)
    waiting: dict[int, float] = field(default_factory=dict)

    def decide(self, state: int, action: int) -> None:
        self.states.append(state)
        self.actions.append(action)
        last = len(self.states) - 1
        if last in self.waiting:
            self.learn(last, self.waiting.pop(last))

    def report(self, n: int, reward: float) -> None:
        if self.discount > 0 and n == len(self.states):
            self.waiting[n] = reward
        else:
            self.learn(n, reward)

    def end(self) -> None:
        for n, reward in self.waiting.items():
            self.learn(n, reward)

    def learn(self, n: int, reward: float) -> None:
        s, a = self.states[n - 1], self.actions[n - 1]
        target = reward + (self.discount * max(self.table[self.states[n]]) if n < len(self.states) else 0.0)
        self.table[s][a] += self.rate * (target - self.table[s][a])


decides = st.tuples(st.sampled_from(TRIPLES), st.integers(0, 5), st.booleans())
reports = st.tuples(st.integers(0, 30), st.booleans(), st.booleans(), st.floats(0, 20))
histories = st.lists(decides | reports, max_size=30)


def messages_of(history: list[Any]) -> list[Any]:
    """Return decisions, and reports of decisions that are still open."""
    messages: list[Any] = []
    open_ones: list[int] = []
    n = 0
    for entry in history:
        if len(entry) == 3:
            n += 1
            messages.append(decision(n, entry[1], entry[0], entry[2]))
            open_ones.append(n)
        elif open_ones:
            which = open_ones.pop(entry[0] % len(open_ones))
            messages.append(report(which, *entry[1:]))
    return messages


@settings(deadline=None, max_examples=60)
@given(histories, st.sampled_from([0.0, 0.5, 1.0]), st.floats(0, 1), st.booleans())
def test_values_match_a_naive_loop(history: list[Any], discount: float, rate: float, prior: bool) -> None:
    naive = Naive(rate, discount, [[float(prior and a == s) for a in range(6)] for s in range(6)])
    state = configured_session(discount=discount, learning_rate=rate, scoring_prior=prior)
    names = Study(study="x").scoring.states
    decided, taken = 0, set()
    for message in [*messages_of(history), session("ending")]:
        step = core.step(state, message, NOW)
        state = step.state
        if isinstance(message, Decision):
            action = message.actions.index(message.strategy)
            naive.decide(names.index(message.cognitive_state), action)
            decided += 1
            taken.add(action)
        elif isinstance(message, ReportPerformance):
            naive.report(int(message.command_id[1:]), of_kind(step.facts, Performance).reward)
        else:
            naive.end()
        policies = [f for f in step.facts if isinstance(f, Policy)]
        for policy in policies:
            assert [row.values for row in policy.states.values()] == naive.table
            epsilon = 0.75 * max(0.0, 1 - decided / 100)
            candidates = [a for a in range(6) if a not in taken] or list(range(6))
            for row in policy.states.values():
                greedy = row.values.index(max(row.values))
                expected = [
                    epsilon / len(candidates) * (a in candidates) + (1 - epsilon) * (a == greedy) for a in range(6)
                ]
                assert row.probabilities == pytest.approx(expected, abs=1e-12)


@settings(deadline=None, max_examples=60)
@given(
    histories, st.integers(0, 30), st.sampled_from([0.0, 0.5]), st.sampled_from(["q-learning", "scoring", "thompson"])
)
def test_restart_at_any_point_changes_nothing(history: list[Any], at: int, discount: float, name: str) -> None:
    messages = [session(), config(discount=discount, name=name), *messages_of(history), session("ending")]
    living: LearnerState | None = None
    restarted: LearnerState | None = None
    for i, message in enumerate(messages):
        if i == at % len(messages) and restarted is not None:
            text = core.dump(restarted)
            restarted = core.load(text)
            assert restarted == living
            assert core.dump(restarted) == text
        step, again = core.step(living, message, NOW), core.step(restarted, message, NOW)
        assert step.facts == again.facts
        assert step.result == again.result
        living, restarted = step.state, again.state


@settings(deadline=None, max_examples=30)
@given(histories)
def test_refused_command_changes_no_state(history: list[Any]) -> None:
    state, _ = folded(session(), config(), *messages_of(history))
    before = core.dump(state)
    for timed_out in (False, True):
        with pytest.raises((ShiftError, InputsMissing)):
            core.step(state, report(999), NOW, timed_out=timed_out)
    assert core.dump(state) == before


# --- corrections ---


def correction(
    n: int, understood: bool = True, able: bool = True, seconds: float = 5.0, **need: int
) -> ReportPerformance:
    """Return a correction of the report of the ``n``-th decision."""
    changed = report(n, understood, able, seconds, **need)
    return changed.model_copy(update={"command_id": f"c-{n}", "corrects": f"d{n}"})


def test_correction_is_recorded_in_addition_and_counts_instead() -> None:
    state, facts = folded(session(), config(), decision(1), report(1, False, False), decision(2), report(2))
    first, second = [f for f in facts if isinstance(f, Performance)]
    done = core.step(state, correction(1, True, True, 2.0), NOW)
    performance = of_kind(done.facts, Performance)
    assert (performance.corrects, performance.decision_id, performance.n, performance.result) == (True, "d1", 3, 1)
    assert (first.result, second.result) == (1, 2)
    assert performance.cumulative_reward == pytest.approx(second.reward + exp(-0.2))
    assert of_kind(done.facts, Transition).reward == pytest.approx(exp(-0.2))
    assert of_kind(done.facts, Policy).cumulative_reward == performance.cumulative_reward


@pytest.mark.parametrize("name", ["q-learning", "epsilon-greedy", "ucb1", "thompson", "linear-thompson", "planner"])
def test_correction_is_learned_in_addition(name: str) -> None:
    state, _ = folded(session(), config(name=name), decision(1), report(1, False, False))
    learner, memory = learner_named(name), state.memory
    done = core.step(state, correction(1), NOW)
    known = state.reported["d1"].open
    naive = learner.on_reward(core.context_of(state.config.study), memory, known.taken, exp(-0.5), None)  # type: ignore[union-attr]
    assert learner.dump(done.state.memory) == learner.dump(naive)


def test_correction_of_a_waiting_report_is_learned_instead_of_it() -> None:
    start = (session(), config(discount=0.9), decision(1), report(1, False, False))
    _, corrected = folded(*start, correction(1), decision(2))
    _, right_at_once = folded(*start[:3], report(1), decision(2))
    (once,), (other,) = ([f for f in facts if isinstance(f, Transition)] for facts in (corrected, right_at_once))
    assert (once.reward, once.value) == (other.reward, other.value)


def test_correction_with_a_discount_is_learned_with_the_decision_that_followed() -> None:
    state, _ = folded(session(), config(discount=0.9), decision(1), report(1, False, False), decision(2))
    assert state.reported["d1"].open.following is not None
    facts = core.step(state, correction(1), NOW).facts
    assert [type(f).__name__ for f in facts] == ["Performance", "Transition", "Policy"]


def test_repeated_correction_gets_the_report_in_force() -> None:
    state, _ = folded(session(), config(), decision(1), report(1, False, False), correction(1))
    again = core.step(state, correction(1).model_copy(update={"command_id": "c-9"}), NOW)
    assert (again.state, again.facts, again.repeat) == (state, (), True)
    assert isinstance(again.result, dict)
    assert (again.result["n"], again.result["corrects"]) == (2, True)
    back = core.step(state, correction(1, False, False).model_copy(update={"command_id": "c-8"}), NOW)
    assert of_kind(back.facts, Performance).cumulative_reward == pytest.approx(-exp(-0.5))


def test_correction_without_a_report_is_refused() -> None:
    state, _ = folded(session(), config(), decision(1))
    with pytest.raises(Conflict, match="decision d1 has no report yet"):
        core.step(state, correction(1), NOW)
    with pytest.raises(UnknownThing, match="no report of decision d7 that can be corrected; the last 256"):
        core.step(state, correction(7), NOW, timed_out=True)


def test_number_of_correctable_reports_is_bounded() -> None:
    state = configured_session(name="scoring")
    for n in range(1, core.CORRECTABLE + 3):
        state, _ = core.step(state, decision(n), NOW).state, None
        state = core.step(state, report(n), NOW).state
    assert len(state.reported) == core.CORRECTABLE
    assert "d2" not in state.reported
    assert core.load(core.dump(state)) == state


@pytest.mark.parametrize(("seconds", "count"), [(3600.0, 0), (3600.5, 2), (5000.0, 2)])
def test_duration_above_an_hour_causes_a_warning(seconds: float, count: int) -> None:
    _, facts = folded(session(), config(), decision(1), report(1, seconds=seconds))
    warnings = of_kind(facts, Performance).warnings
    assert len(warnings) == count
    assert all("must be in seconds" in w for w in warnings)
