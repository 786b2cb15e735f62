"""The planner's beliefs about a person, compared with Bayes' rule in plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from shift_learner.learner import Context
from shift_learner.learners.planning import beliefs as b
from shift_learner.learners.planning.plausible import plausible_people
from shift_study.study import Study

CONTEXT = Context(Study.model_validate({"study": "s", "learner": {"name": "planner"}}))
RNG = np.random.default_rng(4)


def naive_beliefs(seen: list[tuple[int, int, bool]]) -> np.ndarray:
    """Return the posterior over preferences by Bayes' rule in plain loops, with the share returned each time."""
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    change = CONTEXT.study.learner.change_probability
    prior = people.preferences.prior
    weights = prior.copy()
    for triple, action, success in seen:
        for k in range(len(weights)):
            yes = 0.975 if people.preferences.success[k, triple * 6 + action] else 0.025
            weights[k] *= yes if success else 1 - yes
        weights = (1 - change) * weights / weights.sum() + change * prior
    return weights


def test_posterior_over_preferences_follows_bayes_rule() -> None:
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    prior = b.priors(people, CONTEXT.study.learner)
    seen = [(int(RNG.integers(30)), int(RNG.integers(6)), bool(RNG.integers(2))) for _ in range(12)]
    found = b.initial(prior, 1)
    for triple, action, success in seen:
        found = b.update(found, np.array([triple]), np.array([action]), np.array([success]))
    np.testing.assert_allclose(found.preferences[0], naive_beliefs(seen), rtol=1e-9)
    for weights in (*found.columns, found.preferences, found.experts):
        np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert ((found.chances > 0) & (found.chances < 1)).all()


@pytest.mark.parametrize("strategy", [0, 1])
def test_columns_suit_the_suggestion_of_the_table_with_flipped_entries(strategy: int) -> None:
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    unflipped = people.columns[strategy].suits[0].reshape(30, -1)
    assert unflipped.argmax(axis=1).tolist() == [people.levels[a][strategy] for a in CONTEXT.suggestions]
    assert (people.columns[strategy].suits.reshape(1024, 30, -1).sum(axis=2) == 1).all()
    assert people.columns[strategy].flips[0] == 0
