"""The scoring system against the model's table, and against a sum by hand."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_model.vocabulary import AWARENESSES, CAPACITIES, COGNITIVE_STATES, GAZES, TRIPLES, Triple
from shift_study.loading import study_of
from shift_study.scoring import reduce, suggestions, view
from shift_study.study import Study

EO, EM, DM, OS, UF = (
    "engaged_observer", "engaged_misinterpreter", "distracted_misinterpreter", "overwhelmed_struggler", "unfocused",
)  # fmt: skip
MODEL = {
    ("low", "distracted"): (OS, OS, UF, OS, UF),
    ("low", "uncertain"): (OS, OS, UF, OS, UF),
    ("low", "focused"): (OS, OS, EO, OS, EO),
    ("high", "distracted"): (UF, UF, DM, UF, DM),
    ("high", "uncertain"): (UF, UF, DM, UF, DM),
    ("high", "focused"): (EO, EO, EM, EO, EM),
}
"""docs/model.md: unknown, failure, miscalibrated enablement, miscalibrated comprehension, success."""
DEFAULT = Study(study="x").scoring


def weighted(negation: float = 1.0, hesitation: float = 1.0) -> Study:
    """A study with these weights."""
    strategies = {"negation": {"weight": negation}, "hesitation": {"weight": hesitation}}
    return study_of({"study": "x", "scoring": {"strategies": strategies}})


def states(study: Study) -> Counter[str]:
    """How many triples each cognitive state covers."""
    return Counter(reduce(study.scoring, triple).cognitive_state for triple in TRIPLES)


@pytest.mark.parametrize("triple", TRIPLES, ids=lambda t: t.name)
def test_each_of_the_30_triples_has_the_model_s_state(triple: Triple) -> None:
    expected = MODEL[triple.capacity, triple.gaze][AWARENESSES.index(triple.awareness)]
    found = reduce(DEFAULT, triple)
    assert found.cognitive_state == expected
    assert COGNITIVE_STATES[DEFAULT.actions[found.action]] == expected, "each cognitive state is its action"


def test_the_states_cover_5_2_4_9_10_and_0_triples() -> None:
    found = states(Study(study="x"))
    assert [found[name] for name in (EO, EM, DM, OS, UF, "uncertain")] == [5, 2, 4, 9, 10, 0]


@pytest.mark.parametrize(
    ("negation", "hesitation", "appears"),
    [
        (1.0, 1.0, False),
        (1.2499, 1.0, False),
        (1.25, 1.0, True),
        (2.0, 1.0, True),
        (1.0, 1.4999, False),
        (1.0, 1.5, True),
    ],
)
def test_uncertain_appears_from_weight_1_25_or_1_5(negation: float, hesitation: float, appears: bool) -> None:
    assert ("uncertain" in states(weighted(negation, hesitation))) == appears


@given(st.sampled_from(TRIPLES), st.floats(0, 3), st.floats(0, 3))
def test_scores_are_the_weighted_sums_of_the_table_by_hand(triple: Triple, negation: float, hesitation: float) -> None:
    speaks = {
        "negation": (triple.capacity == "high") + (triple.gaze != "focused")
        + (triple.awareness in ("misconception_enabledness", "success")),
        "hesitation": (triple.capacity == "low") + (triple.gaze != "focused")
        + (triple.awareness not in ("misconception_enabledness", "success")),
    }  # fmt: skip
    found = reduce(weighted(negation, hesitation).scoring, triple)
    assert found.scores == {
        "negation": negation * speaks["negation"] / 3,
        "hesitation": hesitation * speaks["hesitation"] / 3,
    }
    level = 0 if found.scores["negation"] < 0.5 - 1e-9 else 1 if found.scores["negation"] < 5 / 6 - 1e-9 else 2
    assert found.action == 2 * level + (found.scores["hesitation"] >= 0.5 - 1e-9)


def test_triples_are_numbered_15_c_5_g_a() -> None:
    assert [t.number for t in TRIPLES] == list(range(30))
    assert TRIPLES[15 * 1 + 5 * 2 + 0] == ("high", "focused", "unknown")
    assert TRIPLES[-1].name == "high/focused/success"
    assert view(TRIPLES[0]).model_dump() == {"capacity": "low", "gaze": "distracted", "awareness": "unknown"}


def test_the_words_are_the_contract_s_in_its_order() -> None:
    assert CAPACITIES == ("low", "high")
    assert GAZES == ("distracted", "uncertain", "focused")
    assert AWARENESSES == (
        "unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success",
    )  # fmt: skip
    assert DEFAULT.actions == (
        ("affirmation", "none"), ("affirmation", "hesitation"), ("negation_affirmation", "none"),
        ("negation_affirmation", "hesitation"), ("negation", "none"), ("negation", "hesitation"),
    )  # fmt: skip
    assert DEFAULT.states == (EO, OS, EM, UF, DM, "uncertain")


def test_suggestions_are_in_the_triples_order() -> None:
    assert suggestions(DEFAULT) == tuple(reduce(DEFAULT, triple).action for triple in TRIPLES)
