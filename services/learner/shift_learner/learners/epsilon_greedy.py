"""Epsilon-greedy on the triples, with the paper's decay of epsilon (Sutton & Barto 2018, sections 2.2 and 2.4).

The value of an action is the mean of its rewards; the prior's value counts as one of them: (Q0 + sum) / (1 + visits).
An exploring step is uniform over all actions.
"""

from __future__ import annotations

from shift_learner.learner import Context, Row
from shift_learner.learners.tabular import Memory, Tabular, greedy, prior_values


class EpsilonGreedy(Tabular):
    """An epsilon-greedy learner on the 30 triples."""

    name = "epsilon-greedy"

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Spread epsilon evenly over all actions and put the rest on the best one."""
        visits = memory.visits[state]
        values = [
            (prior + total) / (1 + n)
            for prior, total, n in zip(prior_values(context, state), memory.rewards[state], visits, strict=True)
        ]
        epsilon = self.epsilon(context, memory)
        share = epsilon / context.actions
        return Row([share + (1.0 - epsilon) * best for best in greedy(values)], values, list(visits))

    def epsilon(self, context: Context, memory: Memory) -> float:
        """Return epsilon, which falls linearly to 0 over the planned interactions, by the decisions made so far."""
        study = context.study
        return study.learner.epsilon * max(0.0, 1.0 - memory.decisions / study.interactions)
