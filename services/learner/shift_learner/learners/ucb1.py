"""UCB1 on the triples (Auer, Cesa-Bianchi & Fischer 2002).

It takes the action with the largest mean + c x sqrt(2 ln n / visits), where n is the number of visits of the triple.
Rewards are mapped from [-scale, scale] to 0..1, the range of the bound. Actions without visits come first: with the
scoring prior the suggested one, then the others in their order. The rule is deterministic.
"""

from __future__ import annotations

from math import log, sqrt

from shift_learner.learner import Context, Row
from shift_learner.learners.tabular import Memory, Tabular, greedy, prior_values

UNTRIED = 1e6
"""The value of an action without visits, plus its prior; JSON has no infinity."""


class Ucb1(Tabular):
    """UCB1 on the 30 triples."""

    name = "ucb1"

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Put all probability on the largest upper bound."""
        visits = memory.visits[state]
        scale = context.study.reward.scale or 1.0
        width = context.study.learner.exploration
        values = [
            (total / n / scale + 1) / 2 + width * sqrt(2 * log(sum(visits)) / n) if n else UNTRIED + prior
            for prior, total, n in zip(prior_values(context, state), memory.rewards[state], visits, strict=True)
        ]
        return Row(greedy(values), values, list(visits))
