"""The decider's core: the draw, what it waits for, what it says when it must not wait any longer, overrides."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_decider import core
from shift_decider.core import ANY_TASK, DeciderState, MissingInputs, decide, missing_inputs
from shift_model.random_numbers import pick, uniform
from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import Conflict, MalformedMessage, ShiftError, Unavailable, UnknownThing
from shift_schemas.messages import (
    AwarenessView,
    CapacityView,
    Config,
    Decide,
    Decision,
    Estimate,
    Fact,
    GazeView,
    Observation,
    Override,
    Policy,
    PolicyRow,
    Seen,
    Session,
    SetOverride,
)
from shift_schemas.timestamps import Stamp
from shift_study.loading import study_json, study_of
from shift_study.scoring import reduce
from shift_study.study import Study

NOW = Stamp(sec=1_700_000_000, nsec=0)
SCORING = Study(study="x").scoring
FIRST_ROW = [0.375, 0.125, 0.125, 0.125, 0.125, 0.125]
PLAIN, NEGATED = {"negation": "affirmation", "hesitation": "none"}, {"negation": "negation", "hesitation": "none"}


def session(state: Any = "live", seed: int = 7) -> Session:
    """The session's fact."""
    return Session(session="s1", stamp=NOW, participant="P01", study="x", seed=seed, state=state, started=NOW)


def config(version: int = 1, **given: Any) -> Config:
    """A configuration."""
    return Config(session="s1", stamp=NOW, version=version, study=study_json(study_of({"study": "x", **given})))


def observation(
    version: int = 1, tasks: dict[str, Any] | None = None, triple: Triple = TRIPLES[25], **seen: Any
) -> Observation:
    """A partner model; ``tasks`` is task -> awareness class."""
    return Observation(
        session="s1", stamp=NOW, version=version, seen=Seen(**{"config": 1, **seen}),
        capacity=CapacityView(value=1.0, category=triple.capacity),
        gaze=GazeView(category=triple.gaze, weights={}, focus_shift=0.0, aoi="", fixations=0, dropped=0),
        awareness={
            task: AwarenessView(category=category, comprehension=0.0, enabledness=0.0, results=1)
            for task, category in (tasks or {}).items()
        },
    )  # fmt: skip


def policy(for_n: int = 1, row: list[float] | None = None, values: list[float] | None = None, **given: Any) -> Policy:
    """A policy with the same row in every state."""
    row, values = row or FIRST_ROW, values or [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    names = given.pop("names", SCORING.states)
    return Policy(
        session="s1", stamp=NOW, version=given.pop("version", for_n), learner="q-learning", for_n=for_n,
        seen=Seen(**{"decision": for_n - 1, "config": 1, **given}),
        actions=[SCORING.strategy(a) for a in SCORING.actions],
        states={name: PolicyRow(probabilities=row, values=values, visits=[0] * 6) for name in names},
    )  # fmt: skip


def folded(*messages: Any) -> DeciderState:
    """The state after these messages."""
    state: DeciderState | None = None
    for message in messages:
        state = core.step(state, message, NOW).state
    assert state is not None
    return state


def ask(
    state: DeciderState, task: str = "grasp", timed_out: bool = False, name: str = "d1", **need: Any
) -> Step[DeciderState]:
    """One decision."""
    return core.step(
        state, Decide(command_id=name, session="s1", task=task, need=Seen(**need)), NOW, timed_out=timed_out
    )


def made(state: DeciderState, **given: Any) -> Decision:
    """The decision that is made."""
    (fact,) = ask(state, **given).facts
    assert isinstance(fact, Decision)
    return fact


READY = (session(), config(), observation(), policy())


# --- the draw ---


def test_a_decision_carries_all_that_it_was_derived_from() -> None:
    step = ask(folded(session(), config(3), observation(9, config=3, gaze={"tx": 4}), policy(version=5, config=3)))
    (found,) = step.facts
    assert isinstance(found, Decision)
    assert step.result is found
    assert found.versions.model_dump() == {"observation": 9, "policy": 5, "config": 3}
    assert found.seen == Seen(gaze={"tx": 4}, config=3, observation=9, policy=5)
    assert (found.n, found.seed, found.decision_id, found.task, found.stale) == (1, 7, "d1", "grasp", False)
    assert found.scores == {"negation": 1 / 3, "hesitation": 1 / 3}
    assert found.observation.model_dump() == {"capacity": "high", "gaze": "focused", "awareness": "unknown"}
    assert found.suggested == PLAIN
    assert [tuple(a.values()) for a in found.actions] == list(SCORING.actions)


@pytest.mark.parametrize("strategy", SCORING.choices, ids=lambda s: "+".join(s.values()))
def test_a_decision_has_the_text_of_its_strategy_and_none_without_phrases(strategy: dict[str, str]) -> None:
    sentences = {level: f"{level} {{it}}" for level in ("affirmation", "negation_affirmation", "negation")}
    templates = {"hesitation": {"hesitation": "um, {sentence}"}}
    phrases = {"sentences": sentences, "templates": templates, "tasks": {"grasp": {"words": {"it": "the cup"}}}}
    level, pause = strategy["negation"], strategy["hesitation"] == "hesitation"
    row = [float(a == tuple(strategy.values())) for a in SCORING.actions]
    spoken = folded(session(), config(phrases=phrases), observation(), policy(row=row))
    assert made(spoken).text == (f"Um, {level} the cup" if pause else f"{level[0].upper()}{level[1:]} the cup")
    assert made(spoken, task="turn").text is None
    assert made(folded(session(), config(), observation(), policy(row=row))).text is None


def test_an_override_is_said_with_its_own_sentence() -> None:
    phrases = {"sentences": {"affirmation": "go.", "negation": "stop."}}
    state = folded(session(), config(phrases=phrases), observation(), policy())
    command = SetOverride(command_id="o1", session="s1", task="grasp", strategy=NEGATED)
    assert made(core.step(state, command, NOW).state).text == "Stop."


rows = st.lists(st.integers(0, 5), min_size=6, max_size=6).filter(any).map(lambda w: [x / sum(w) for x in w])


@settings(deadline=None)
@given(st.integers(0, 2**53 - 1), st.integers(0, 500), rows, st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_the_draw_is_addressed_by_seed_and_number_and_its_propensity_is_the_row_s(
    seed: int, before: int, row: list[float], values: list[float]
) -> None:
    state = folded(session(seed=seed), config(), observation(decision=before), policy(before + 1, row, values))
    found = made(DeciderState(**{**vars(state), "n": before}))
    action = pick(row, uniform(seed, before + 1))
    assert found.n == before + 1
    assert found.strategy == found.actions[action]
    assert found.propensity == found.probabilities[action] == row[action] > 0
    assert found.explored == (action != values.index(max(values)))
    assert found.policy_source == "learner"


def test_over_many_sessions_strategies_are_taken_as_often_as_the_row_says() -> None:
    state = folded(*READY)
    counts = Counter(
        SCORING.actions.index(tuple(made(DeciderState(**{**vars(state), "seed": seed})).strategy.values()))
        for seed in range(2000)
    )
    assert all(abs(counts[a] / 2000 - p) < 0.04 for a, p in enumerate(FIRST_ROW))


@pytest.mark.parametrize("triple", TRIPLES, ids=lambda t: t.name)
def test_the_row_is_that_of_the_cognitive_state_or_of_the_triple(triple: Triple) -> None:
    seen = observation(triple=triple, tasks={"grasp": triple.awareness})
    by_state = made(folded(session(), config(), seen, policy()))
    by_triple = made(folded(session(), config(), seen, policy(names=[t.name for t in TRIPLES])))
    expected = reduce(SCORING, triple)
    assert by_state.cognitive_state == by_triple.cognitive_state == expected.cognitive_state
    assert (by_state.state, by_triple.state) == (expected.cognitive_state, triple.name)
    assert by_state.suggested == SCORING.strategy(SCORING.actions[expected.action])


# --- what a decision waits for, and what it says when it does not ---


@pytest.mark.parametrize(
    ("messages", "need", "owners"),
    [((session(), config(), observation()), {}, ("learner",)), ((session(), config(), policy()), {}, ("monitor",)),
     ((session(), config()), {}, ("monitor", "learner")), (READY, {"gaze": {"tx": 0}}, ("monitor",)),
     ((session(), config(), observation(gaze={"tx": 3}), policy()), {"gaze": {"tx": 4}}, ("monitor",)),
     (READY, {"performance": 1}, ("monitor", "learner")),
     ((session(), config(), observation(performance=1), policy()), {"performance": 1}, ("learner",)),
     ((session(), config(2), observation(), policy()), {}, ("monitor", "learner")),
     ((session(), config(), observation(), policy(2)), {}, ("learner",)),
     (READY, {"config": 2}, ("recorder", ))],
    ids=str,
)  # fmt: skip
def test_it_waits_for_those_whose_news_it_lacks(
    messages: tuple[Any, ...], need: dict[str, Any], owners: tuple[str, ...]
) -> None:
    with pytest.raises(InputsMissing) as waiting:
        ask(folded(*messages), **need)
    assert waiting.value.owners == owners
    assert waiting.value.give_up_s == 2.0


def test_before_the_configuration_it_waits_for_the_recorder() -> None:
    with pytest.raises(InputsMissing) as waiting:
        ask(folded(session()))
    assert waiting.value.owners == ("recorder",)
    with pytest.raises(Unavailable, match="recorder"):
        ask(folded(session()), timed_out=True)


def test_it_waits_as_long_as_the_study_says() -> None:
    with pytest.raises(InputsMissing) as waiting:
        ask(folded(session(), config(decider={"wait_s": 30.0})))
    assert waiting.value.give_up_s == 30.0


def test_the_second_decision_waits_until_the_first_was_applied_everywhere() -> None:
    after = ask(folded(*READY)).state
    assert missing_inputs(after, Seen()) == MissingInputs(config=False, observation=True, policy=True)
    current = folded_on(after, observation(2, decision=1), policy(2))
    assert missing_inputs(current, Seen()) == MissingInputs(config=False, observation=False, policy=False)
    assert made(current, name="d2").n == 2


def folded_on(state: DeciderState, *messages: Any) -> DeciderState:
    """The state after these messages more."""
    for message in messages:
        state = core.step(state, message, NOW).state
    return state


def test_without_a_new_observation_it_goes_on_with_the_old_and_says_stale() -> None:
    state = folded_on(ask(folded(*READY)).state, policy(2))
    found = made(state, timed_out=True, name="d2")
    assert (found.stale, found.policy_source, found.versions.observation) == (True, "learner", 1)


def test_without_a_new_policy_it_goes_on_with_the_last() -> None:
    state = folded_on(ask(folded(*READY)).state, observation(2, decision=1))
    found = made(state, timed_out=True, name="d2")
    assert (found.stale, found.policy_source, found.versions.policy) == (False, "last_policy", 1)
    assert found.propensity in FIRST_ROW


def test_without_any_policy_it_follows_the_scoring_system() -> None:
    found = made(folded(session(), config(), observation()), timed_out=True)
    assert found.policy_source == "scoring"
    assert found.probabilities == [1, 0, 0, 0, 0, 0]
    assert found.strategy == found.suggested == PLAIN
    assert (found.propensity, found.explored, found.versions.policy) == (1.0, False, 0)


def test_without_any_observation_it_is_unavailable() -> None:
    with pytest.raises(Unavailable, match="monitor"):
        ask(folded(session(), config(), policy()), timed_out=True)


def test_a_task_that_the_study_does_not_have_is_unknown_with_those_that_there_are() -> None:
    state = folded(session(), config(tasks=["grasp", "turn"]), observation(), policy())
    with pytest.raises(UnknownThing, match="no task 'pour'; it has grasp, turn"):
        ask(state, task="pour")
    assert made(state, task="turn").task == "turn"
    assert made(folded(*READY), task="anything").task == "anything", "no tasks named: any id is one"


def test_nothing_is_decided_without_a_session_or_after_its_end() -> None:
    with pytest.raises(UnknownThing):
        core.step(None, Decide(command_id="d1", session="s1", task="grasp"), NOW)
    for state in ("ending", "ended"):
        ended = folded(*READY, session(state))
        with pytest.raises(Conflict, match="has ended"):
            ask(ended)
        with pytest.raises(Conflict, match="has ended"):
            override(ended)


# --- overrides ---


def override(state: DeciderState, task: str = "grasp", name: str = "o1", **given: Any) -> Step[DeciderState]:
    """One override."""
    command = {"command_id": name, "session": "s1", "task": task, "strategy": NEGATED, "reason": "because", **given}
    return core.step(state, SetOverride(**command), NOW)


def test_an_override_holds_for_the_task_s_next_decision_only() -> None:
    state = override(folded(*READY)).state
    step = ask(state)
    (first,) = step.facts
    assert isinstance(first, Decision)
    assert (first.strategy, first.propensity, first.policy_source) == (NEGATED, None, "override")
    assert (first.override_id, first.reason, first.explored) == ("o1", "because", False)
    assert first.probabilities == FIRST_ROW, "what it would have drawn from"
    second = made(folded_on(step.state, observation(2, decision=1), policy(2)), name="d2")
    assert (second.policy_source, second.override_id, second.reason) == ("learner", "", "")
    assert second.propensity is not None


@pytest.mark.parametrize(("format_", "recorded"), [(5, True), (4, False)])
def test_overridden_decision_records_what_would_have_been_chosen(format_: int, recorded: bool) -> None:
    for seed in range(20):
        begun = session(seed=seed).model_copy(update={"format": format_})
        state = folded(begun, *READY[1:])
        own = made(state).strategy
        found = made(override(state).state)
        assert found.strategy == NEGATED
        assert found.without_override == (own if recorded else None)
    assert made(state).without_override is None


@pytest.mark.parametrize("minimum", [0.0, 0.02, 0.1, 1 / 6])
@pytest.mark.parametrize("row", [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], FIRST_ROW, [0.5, 0.5, 0.0, 0.0, 0.0, 0.0]])
def test_each_action_keeps_the_minimum_propensity(minimum: float, row: list[float]) -> None:
    configured = config(decider={"minimum_propensity": minimum})
    found = made(folded(session(), configured, observation(), policy(row=row)))
    assert found.probabilities == pytest.approx([(1 - 6 * minimum) * p + minimum for p in row])
    assert min(found.probabilities) >= min(minimum, 1 / 6)
    assert sum(found.probabilities) == pytest.approx(1)
    assert found.propensity == found.probabilities[found.actions.index(found.strategy)]
    assert found.actions.index(found.strategy) == pick(found.probabilities, uniform(7, 1))


def test_minimum_propensity_holds_without_a_policy_and_draws_every_action() -> None:
    configured = config(decider={"minimum_propensity": 0.1})
    drawn = Counter(
        made(folded(session(seed=seed), configured, observation()), timed_out=True).actions.index(
            made(folded(session(seed=seed), configured, observation()), timed_out=True).strategy
        )
        for seed in range(300)
    )
    assert len(drawn) == 6


def test_an_override_waits_for_its_own_task() -> None:
    step = ask(override(folded(*READY), task="turn").state, task="grasp")
    (other,) = step.facts
    assert isinstance(other, Decision)
    assert other.policy_source == "learner"
    mine = made(folded_on(step.state, observation(2, decision=1), policy(2)), task="turn", name="d2")
    assert mine.policy_source == "override"


def test_the_last_override_before_the_decision_counts() -> None:
    first = override(folded(*READY)).state
    found = made(override(first, name="o2", strategy=PLAIN).state)
    assert (found.override_id, found.strategy) == ("o2", PLAIN)


def test_an_override_is_a_fact_with_the_study_s_strategies_in_order() -> None:
    step = override(folded(*READY), strategy=dict(reversed(NEGATED.items())))
    (fact,) = step.facts
    assert isinstance(fact, Override)
    assert list(fact.strategy) == ["negation", "hesitation"]
    assert step.result is fact


@pytest.mark.parametrize(
    ("strategy", "field"),
    [({}, "strategy.negation"), ({"negation": "negation"}, "strategy.hesitation"),
     (NEGATED | {"pace": "slow"}, "strategy.pace"),
     (NEGATED | {"negation": "NEGATION"}, "strategy.negation"),
     (NEGATED | {"hesitation": "negation"}, "strategy.hesitation"),
     ({"n" * 9000: "x" * 9000} | NEGATED, "strategy." + "n" * 79 + "…")],
    ids=str,
)  # fmt: skip
def test_an_override_that_is_no_strategy_is_refused_by_field(strategy: dict[str, str], field: str) -> None:
    with pytest.raises(MalformedMessage) as refused:
        override(folded(*READY), strategy=strategy)
    assert refused.value.errors[0].field == field
    assert len(refused.value.detail) < 300


def test_an_override_of_an_unknown_task_is_refused() -> None:
    with pytest.raises(UnknownThing, match="no task 'pour'"):
        override(folded(session(), config(tasks=["grasp"]), observation(), policy()), task="pour")


# --- estimates ---


def estimates(step: Step[DeciderState]) -> list[Estimate]:
    """The estimates among the facts."""
    return [f for f in step.facts if isinstance(f, Estimate)]


def test_estimates_come_when_scores_or_state_change_and_only_then() -> None:
    state = folded(session(), config())
    first = core.step(state, observation(), NOW)
    assert [(e.task, e.cognitive_state) for e in estimates(first)] == [(ANY_TASK, "engaged_observer")]
    assert estimates(core.step(first.state, observation(2), NOW)) == []
    changed = core.step(first.state, observation(3, triple=Triple("high", "distracted", "unknown")), NOW)
    assert [e.cognitive_state for e in estimates(changed)] == ["unfocused"]
    other_scores = config(2, scoring={"strategies": {"negation": {"weight": 1.1}}})
    (reweighed,) = estimates(core.step(first.state, other_scores, NOW))
    assert reweighed.scores["negation"] == pytest.approx(1.1 / 3)
    assert reweighed.seen.config == 2
    assert estimates(core.step(first.state, config(2, reward={"scale": 2}), NOW)) == []


def test_there_is_an_estimate_per_task_of_the_study() -> None:
    step = core.step(folded(session(), config(tasks=["grasp", "turn"])), observation(tasks={"turn": "success"}), NOW)
    assert [(e.task, e.observation.awareness) for e in estimates(step)] == [("grasp", "unknown"), ("turn", "success")]


def test_where_any_id_is_a_task_each_with_results_has_one() -> None:
    step = core.step(folded(session(), config()), observation(tasks={"turn": "success"}), NOW)
    assert [(e.task, e.cognitive_state) for e in estimates(step)] == [
        (ANY_TASK, "engaged_observer"), ("turn", "engaged_misinterpreter"),
    ]  # fmt: skip


# --- state ---

events = st.one_of(
    st.builds(lambda t, v: observation(v, triple=t), st.sampled_from(TRIPLES), st.integers(1, 9)),
    st.builds(lambda n: policy(n), st.integers(1, 5)),
    st.builds(lambda v: config(v), st.integers(1, 3)),
    st.builds(lambda i, t: Decide(command_id=f"d{i}", session="s1", task=t), st.integers(1, 9), st.sampled_from("ab")),
    st.builds(
        lambda i, t, s: SetOverride(command_id=f"o{i}", session="s1", task=t, strategy=s),
        st.integers(1, 99), st.sampled_from(["a", "b"]), st.sampled_from([PLAIN, NEGATED]),
    ),
)  # fmt: skip


@settings(deadline=None)
@given(st.lists(events, max_size=20), st.integers(0, 20))
def test_a_restart_at_any_point_changes_nothing(messages: list[Any], at: int) -> None:
    living = restarted = folded(*READY)
    for i, message in enumerate(messages):
        if i == at % len(messages):
            restarted = core.load(core.dump(restarted))
            assert restarted == living
        results: list[Any] = []
        for state in (living, restarted):
            try:
                results.append(core.step(state, message, NOW, timed_out=True))
            except ShiftError as e:
                results.append((type(e), e.detail))
        assert results[0] == results[1]
        if isinstance(results[0], Step):
            living, restarted = results[0].state, results[1].state


def test_the_preview_s_function_is_the_decision_s_and_changes_nothing() -> None:
    state = folded(*READY)
    before = core.dump(state)
    previewed = decide(state, "grasp", "d1", Seen(), NOW, timed_out=False)
    assert core.dump(state) == before
    facts: tuple[Fact, ...] = ask(state).facts
    assert facts == (previewed,)


def test_facts_of_others_leave_the_state_as_it_is() -> None:
    state = folded(*READY)
    assert core.step(state, made(state), NOW) == Step(state)
