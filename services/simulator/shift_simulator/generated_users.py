"""Generated users whose reactions differ from the scoring table, for tests of learners beyond users A to D.

Pure. Each family is a function of a numpy generator, so one seed gives one user. The planner's constants were
chosen with these users, and never with A to D.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from shift_model.vocabulary import TRIPLES
from shift_study.scoring import suggestions
from shift_study.scoring_table import ScoringSettings

from shift_simulator.random_streams import Bools, Floats, Ints
from shift_simulator.users import ACTIONS, User

SHAPE = (2, 3, 5)
"""Numbers of classes of capacity, gaze and awareness."""


def flipped(rng: np.random.Generator, entries: int) -> User:
    """Return a user for whom the scoring system is right once ``entries`` of its twenty entries are flipped."""
    return _user(_flipped(rng, entries))


def picky(rng: np.random.Generator) -> User:
    """Return a user with at most one flipped entry; a group of actions succeeds only under a random condition."""
    return _user(_picky(rng))


def random_right(rng: np.random.Generator) -> User:
    """Return a user for whom one random action of the six is right in each triple."""
    return _user(_right(rng.integers(ACTIONS, size=len(TRIPLES))))


def random_table(rng: np.random.Generator) -> User:
    """Return a user for whom each action succeeds in each triple with probability 0.4."""
    return _user((rng.random((len(TRIPLES), ACTIONS)) < 0.4).astype(np.float64))


def changing(rng: np.random.Generator) -> User:
    """Return a picky user who changes to up to two flipped entries after 50 interactions."""
    first, then = _picky(rng), _flipped(rng, int(rng.integers(3)))
    return _user(first, changes=[{"at": 50, "success": then.tolist()}])


def independent(rng: np.random.Generator) -> User:
    """Return a user with one flipped entry whose gaze class is drawn again each time."""
    return _user(_flipped(rng, 1), gaze={"keep": 0.0})


def wrong_capacity(rng: np.random.Generator) -> User:
    """Return a picky user whose capacity follows other constants than the study assumes."""
    return _user(_picky(rng), capacity={"recovery": 0.1, "demanding_cost": 0.1, "other_cost": 0.2})


FAMILIES: dict[str, Callable[[np.random.Generator], User]] = {
    "2 entries flipped": partial(flipped, entries=2),
    "4 entries flipped": partial(flipped, entries=4),
    "8 entries flipped": partial(flipped, entries=8),
    "picky": picky,
    "random right action": random_right,
    "random table": random_table,
    "changing": changing,
    "independent gaze": independent,
    "wrong capacity constants": wrong_capacity,
}
"""The families by their names in the documentation."""


# --- tables ---


def _user(table: Floats, **differs: object) -> User:
    return User.model_validate({"user": "generated", "success": table.tolist()} | differs)


def _right(actions: Ints | tuple[int, ...]) -> Floats:
    table = np.zeros((len(TRIPLES), ACTIONS))
    table[np.arange(len(TRIPLES)), np.asarray(actions, dtype=np.int64)] = 1.0
    return table


def _flipped(rng: np.random.Generator, entries: int) -> Floats:
    scoring = ScoringSettings.model_validate({}).model_dump()
    table = scoring["table"]
    places = [(part, row, name) for part in table for row in table[part] for name in table[part][row]]
    for i in rng.choice(len(places), entries, replace=False):
        part, row, name = places[i]
        table[part][row][name] = 1 - table[part][row][name]
    return _right(suggestions(ScoringSettings.model_validate(scoring)))


def _picky(rng: np.random.Generator) -> Floats:
    table = _flipped(rng, int(rng.integers(2)))
    negation, hesitation = np.arange(ACTIONS) // 2, np.arange(ACTIONS) % 2
    group = negation >= rng.integers(1, 3) if rng.integers(2) == 0 else hesitation == 1
    if rng.random() < 0.3:
        group = ~group
    table[:, group] = _condition(rng)[:, None]
    return table


def _condition(rng: np.random.Generator) -> Bools:
    """Return where one to three features each lie in a random subset of their classes, bool [30]."""
    holds = np.ones(SHAPE, dtype=bool)
    for feature in rng.permutation(len(SHAPE))[: rng.integers(1, 4)]:
        classes = rng.random(SHAPE[feature]) < 0.5
        if classes.all() or not classes.any():
            classes[rng.integers(len(classes))] ^= True
        holds &= classes.reshape([-1 if i == feature else 1 for i in range(len(SHAPE))])
    condition: Bools = holds.reshape(-1)
    return condition
