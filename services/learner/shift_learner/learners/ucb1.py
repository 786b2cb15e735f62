"""UCB1 on the triples (Auer, Cesa-Bianchi & Fischer 2002).

The action with the largest mean + c x sqrt(2 ln n / visits), n being the visits of the triple; rewards are brought
from [-scale, scale] to the 0..1 that the bound is made for. An action without visits comes first: the suggested one
where the scoring system is the prior, then in their order. Deterministic, so a row is one action's.
"""

from __future__ import annotations

from math import log, sqrt

from shift_learner.learner import Context, Row
from shift_learner.learners.tabular import Memory, Tabular, greedy, prior_values

UNTRIED = 1e6
"""The value of an action without visits, instead of infinity, which JSON cannot say; the prior comes on top."""


class Ucb1(Tabular):
    """See the module."""

    name = "ucb1"

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """All probability on the largest upper bound."""
        visits = memory.visits[state]
        scale = context.study.reward.scale or 1.0
        width = context.study.learner.exploration
        values = [
            (total / n / scale + 1) / 2 + width * sqrt(2 * log(sum(visits)) / n) if n else UNTRIED + prior
            for prior, total, n in zip(prior_values(context, state), memory.rewards[state], visits, strict=True)
        ]
        return Row(greedy(values), values, list(visits))
