"""The registry of learners. To add a learner, write its file here and add its class to ``LEARNERS``."""

from __future__ import annotations

from shift_schemas.errors import InvalidStudy
from shift_schemas.suggestions import did_you_mean

from shift_learner.learner import Learner
from shift_learner.learners.epsilon_greedy import EpsilonGreedy
from shift_learner.learners.linear_thompson import LinearThompson
from shift_learner.learners.planner import Planner
from shift_learner.learners.q_learning import QLearning
from shift_learner.learners.scoring import Scoring
from shift_learner.learners.thompson import Thompson
from shift_learner.learners.ucb1 import Ucb1

LEARNERS: dict[str, Learner] = {
    learner.name: learner
    for learner in (
        QLearning(),
        Scoring(),
        EpsilonGreedy(),
        Ucb1(),
        Thompson(),
        LinearThompson(),
        Planner(),
    )
}


def learner_named(name: str) -> Learner:
    """Return the learner of this name; raise :class:`InvalidStudy`, which lists the learners, if there is none."""
    if name not in LEARNERS:
        meant = did_you_mean(name, LEARNERS)
        raise InvalidStudy(f"learner.name: there is no learner {name!r}; write one of {', '.join(LEARNERS)}{meant}")
    return LEARNERS[name]
