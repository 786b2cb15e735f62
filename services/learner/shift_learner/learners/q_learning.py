"""The paper's learner: Q-learning with decayed epsilon-greedy that tries untaken actions first.

Paper, section III-D (Watkins & Dayan 1992; Tokic 2010; Castro-Gonzalez et al. 2014). The target is r + gamma x max
Q(s'). With the scoring prior, Q0 is ``prior_value`` on the state's own action; every other Q0 is 0. Epsilon falls
linearly to 0 over the planned interactions. An exploring step is uniform among the actions never taken in this run,
or among all actions once each was taken. Greedy ties go to the first action. An action is *taken* when it is decided,
overrides included; visits count reported decisions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from shift_model.q_learning import decayed_epsilon, updated_value

from shift_learner.learner import Context, DecisionView, Row


@dataclass(frozen=True)
class Memory:
    """The Q-table, and the counts that exploration depends on."""

    values: tuple[tuple[float, ...], ...]
    visits: tuple[tuple[int, ...], ...]
    taken: tuple[bool, ...]
    decisions: int = 0


class QLearning:
    """The paper's Q-learning."""

    name = "q-learning"
    on_triples = False

    def initial(self, context: Context) -> Memory:
        """Return Q0, with no action taken."""
        value, n = context.study.learner.prior_value, context.actions
        return Memory(
            values=tuple(tuple(value * preference for preference in row) for row in context.prior),
            visits=((0,) * n,) * n,
            taken=(False,) * n,
        )

    def on_decision(self, context: Context, memory: Memory, taken: DecisionView) -> Memory:
        """Mark the action as taken and count the decision, which lowers epsilon."""
        return replace(
            memory,
            taken=tuple(t or action == taken.action for action, t in enumerate(memory.taken)),
            decisions=memory.decisions + 1,
        )

    def on_reward(
        self, context: Context, memory: Memory, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Memory:
        """Move Q(s, a) by the learning rate towards r + gamma x max Q(s')."""
        settings = context.study.learner
        state, action = taken.cognitive_state, taken.action
        row = list(memory.values[state])
        best_next = 0.0 if following is None else max(memory.values[following.cognitive_state])
        row[action] = updated_value(
            row[action], reward, best_next, learning_rate=settings.learning_rate, discount=settings.discount
        )
        visits = list(memory.visits[state])
        visits[action] += 1
        return replace(
            memory,
            values=(*memory.values[:state], tuple(row), *memory.values[state + 1 :]),
            visits=(*memory.visits[:state], tuple(visits), *memory.visits[state + 1 :]),
        )

    def needs_following(self, context: Context) -> bool:
        """Return True if the discount is above 0."""
        return context.study.learner.discount > 0

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Return the exact distribution of the rule."""
        values = memory.values[state]
        epsilon = self.epsilon(context, memory)
        candidates = [a for a, taken in enumerate(memory.taken) if not taken] or list(range(context.actions))
        probabilities = [0.0] * context.actions
        for action in candidates:
            probabilities[action] = epsilon / len(candidates)
        probabilities[values.index(max(values))] += 1.0 - epsilon
        return Row(probabilities, list(values), list(memory.visits[state]))

    def epsilon(self, context: Context, memory: Memory) -> float:
        """Return epsilon, which falls linearly to 0 over the planned interactions, by the decisions made so far."""
        study = context.study
        return decayed_epsilon(study.learner.epsilon, memory.decisions, study.interactions)

    def dump(self, memory: Memory) -> Any:
        """Return plain lists."""
        return [memory.values, memory.visits, memory.taken, memory.decisions]

    def load(self, context: Context, data: Any) -> Memory:
        """Return the memory with its tuples."""
        values, visits, taken, decisions = data
        return Memory(tuple(map(tuple, values)), tuple(map(tuple, visits)), tuple(taken), decisions)
