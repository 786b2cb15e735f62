"""Contexts and random histories for the tests of learners."""

from __future__ import annotations

from typing import Any

import numpy as np
from shift_learner.learner import Context, DecisionView, Learner, Row, state_names
from shift_study.study import Study


def context(name: str, **settings: Any) -> Context:
    """Return the context of a study with this learner and these settings."""
    return Context(Study.model_validate({"study": "s", "learner": {"name": name} | settings}))


def after_history(learner: Learner, where: Context, interactions: int) -> tuple[Any, list[tuple[int, int, float]]]:
    """Return the memory after a random history, and the history: triple, action and reward of each interaction."""
    rng = np.random.default_rng(5)
    memory, seen = learner.initial(where), []
    for n in range(1, interactions + 1):
        triple, action = int(rng.integers(30)), int(rng.integers(where.actions))
        reward = float(rng.choice([-1, 1]) * rng.uniform(0.4, 0.7))
        taken = DecisionView(n, triple, where.suggestions[triple], action, 1.0)
        memory = learner.on_decision(where, memory, taken)
        memory = learner.on_reward(where, memory, taken, reward, None)
        seen.append((triple, action, reward))
    return memory, seen


def all_rows(learner: Learner, where: Context, memory: Any) -> list[Row]:
    """Return the rows of all states."""
    return [learner.row(where, memory, i) for i in range(len(state_names(learner, where)))]
