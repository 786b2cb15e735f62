"""A table of shares as the prior: a wizard's policy, from which a learner starts."""

from __future__ import annotations

from typing import Any

import pytest
from shift_learner.learner import Context
from shift_learner.learners import learner_named
from shift_study.loading import given_study

SHARES = {"unfocused": {"negation + none": 0.6, "affirmation + hesitation": 0.3}}


def context(**learner: Any) -> Context:
    return Context(given_study({"study": "x", "learner": learner}))


@pytest.mark.parametrize("scoring_prior", [True, False])
def test_shares_are_divided_by_the_largest_and_other_states_keep_the_scoring_prior(scoring_prior: bool) -> None:
    found = context(prior=SHARES, scoring_prior=scoring_prior)
    names = [" + ".join(choice.values()) for choice in found.study.scoring.choices]
    for index, state in enumerate(found.cognitive_states):
        if state == "unfocused":
            assert dict(zip(names, found.prior[index], strict=True)) == {
                **dict.fromkeys(names, 0.0), "negation + none": 1.0, "affirmation + hesitation": 0.5,
            }  # fmt: skip
        else:
            assert found.prior[index] == tuple(float(scoring_prior and a == index) for a in range(6))


@pytest.mark.parametrize("name", ["q-learning", "epsilon-greedy", "ucb1", "thompson"])
def test_learner_prefers_what_the_table_prefers(name: str) -> None:
    with_table, without = context(name=name, prior=SHARES), context(name=name)
    learner = learner_named(name)
    state = with_table.cognitive_states.index("unfocused")
    index = with_table.suggestions.index(state) if learner.on_triples else state
    row = learner.row(with_table, learner.initial(with_table), index)
    names = [" + ".join(choice.values()) for choice in with_table.study.scoring.choices]
    assert max(zip(row.probabilities, names, strict=True))[1] == "negation + none"
    assert row.values[names.index("affirmation + hesitation")] > row.values[names.index("affirmation + none")]
    assert row != learner.row(without, learner.initial(without), index)
    for other in range(len(with_table.suggestions) if learner.on_triples else 6):
        if (with_table.suggestions[other] if learner.on_triples else other) != state:
            assert learner.row(with_table, learner.initial(with_table), other) == learner.row(
                without, learner.initial(without), other
            )
