"""The value of a policy from decisions that another policy made: off-policy estimators. Pure.

The value is the mean reward of a decision if the other policy had chosen in each recorded situation. Three estimators
(Dudík, Langford & Li 2011, "Doubly robust policy evaluation and learning"; Swaminathan & Joachims 2015, "The
self-normalized estimator for counterfactual learning"):

- ``ips``, inverse propensity score: the mean of w r, where w is the probability of the strategy that was used under the
  other policy, divided by the recorded propensity, and r is the reward. Without bias, with a large variance.
- ``snips``, self-normalised: the sum of w r divided by the sum of w. A small bias, a smaller variance.
- ``dr``, doubly robust: a model of the reward, corrected by the weighted errors of the model. The model for a
  participant is fitted to the others (to the other decisions where there is one participant), so that no decision
  judges itself.

The intervals are Student's t over participants; with fewer than :data:`PARTICIPANTS` participants over decisions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from shift_schemas.errors import InvalidSettings

Estimator = Literal["ips", "snips", "dr"]
Floats = NDArray[np.float64]

PARTICIPANTS = 8
"""Chosen: with fewer groups the interval over groups is too wide to be of use (t(0.975, 6) is 2.4)."""
SHRINKAGE = 5.0
"""Chosen: the model of the reward counts each state's and strategy's mean as this many decisions with the overall mean
of the strategy, and that as so many with the mean of all."""
EXTRA = "intervals need scipy: install it with pip install 'shift-mesh[analysis]'"


@dataclass(frozen=True)
class LoggedDecisions:
    """Decisions with a reward and a propensity; all arrays have one entry, or one row, for each decision.

    Attributes
    ----------
    reward
        The recorded reward.
    action
        The number of the strategy that was used.
    propensity
        Its probability when it was chosen, above 0.
    other
        Shape (decisions, actions): the probabilities of the other policy.
    state
        The number of the cognitive state; the model of the reward has a row for each.
    group
        The number of the participant.
    """

    reward: Floats
    action: NDArray[np.int64]
    propensity: Floats
    other: Floats
    state: NDArray[np.int64]
    group: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of decisions."""
        return len(self.reward)

    @property
    def weights(self) -> Floats:
        """The importance weights: the other policy's probability of what was used, over the propensity."""
        weights: Floats = self.other[np.arange(len(self)), self.action] / self.propensity
        return weights


@dataclass(frozen=True)
class Estimate:
    """An estimated value with its 95 % interval.

    ``ess`` is the effective sample size (Kish): the squared sum of the weights over the sum of their squares.
    """

    estimator: str
    estimate: float
    low: float | None
    high: float | None
    ess: float
    max_weight: float

    def as_json(self) -> dict[str, Any]:
        """Return the estimate as ``--json`` prints it."""
        return {
            "estimator": self.estimator, "estimate": self.estimate, "low": self.low, "high": self.high,
            "ess": self.ess, "max_weight": self.max_weight,
        }  # fmt: skip


def estimate_values(logged: LoggedDecisions) -> list[Estimate]:
    """Return the estimates of the other policy's value, in the order of :data:`Estimator`; none without a decision."""
    if not len(logged):
        return []
    weights = logged.weights
    ess = float(weights.sum() ** 2 / (weights**2).sum()) if weights.any() else 0.0
    found = []
    for name in get_args(Estimator):
        value, influence = _ESTIMATORS[name](logged, weights)
        half = _half_width(influence, logged.group)
        low, high = (None, None) if half is None else (value - half, value + half)
        found.append(Estimate(name, value, low, high, ess, float(weights.max())))
    return found


def logged_value(logged: LoggedDecisions) -> Estimate:
    """Return the mean reward of what was done, over the same decisions. Requires at least one decision."""
    value = float(logged.reward.mean())
    half = _half_width(logged.reward - value, logged.group)
    low, high = (None, None) if half is None else (value - half, value + half)
    return Estimate("logged", value, low, high, float(len(logged)), 1.0)


def is_over_participants(logged: LoggedDecisions) -> bool:
    """Return whether the intervals are over participants; otherwise they are over decisions."""
    return len(np.unique(logged.group)) >= PARTICIPANTS


# --- the estimators: the value, and each decision's influence on it ---


def _ips(logged: LoggedDecisions, weights: Floats) -> tuple[float, Floats]:
    terms = weights * logged.reward
    return float(terms.mean()), terms - terms.mean()


def _snips(logged: LoggedDecisions, weights: Floats) -> tuple[float, Floats]:
    total = weights.sum()
    if total == 0:
        return 0.0, np.zeros(len(logged))
    value = float((weights * logged.reward).sum() / total)
    return value, weights * (logged.reward - value) / (total / len(logged))


def _dr(logged: LoggedDecisions, weights: Floats) -> tuple[float, Floats]:
    terms = doubly_robust_terms(logged)
    return float(terms.mean()), terms - terms.mean()


_ESTIMATORS = {"ips": _ips, "snips": _snips, "dr": _dr}


def doubly_robust_terms(logged: LoggedDecisions) -> Floats:
    """Return the term of each decision; their mean is the doubly robust value."""
    model = reward_model(logged)
    used = model[np.arange(len(logged)), logged.action]
    terms: Floats = (logged.other * model).sum(axis=1) + logged.weights * (logged.reward - used)
    return terms


def reward_model(logged: LoggedDecisions) -> Floats:
    """Return the expected reward of each strategy at each decision, shape (decisions, actions).

    It is the mean reward of the strategy in the state, drawn towards the mean of the strategy, and that towards the
    mean of all; each without the rewards of the decision's own participant, or without the decision itself where there
    is one participant.
    """
    group = logged.group if len(np.unique(logged.group)) > 1 else np.arange(len(logged))
    states, actions = int(logged.state.max()) + 1, logged.other.shape[1]
    _, number = np.unique(group, return_inverse=True)
    rewards, counts = np.zeros((2, number.max() + 1, states, actions))
    np.add.at(rewards, (number, logged.state, logged.action), logged.reward)
    np.add.at(counts, (number, logged.state, logged.action), 1.0)
    means = _shrunk_means(rewards.sum(axis=0) - rewards, counts.sum(axis=0) - counts)
    model: Floats = means[number, logged.state]
    return model


def _shrunk_means(rewards: Floats, counts: Floats) -> Floats:
    """Return the means by state and action, drawn towards those by action and of all: (groups, states, actions)."""
    overall = rewards.sum(axis=(1, 2)) / np.maximum(counts.sum(axis=(1, 2)), 1.0)
    by_action = (rewards.sum(axis=1) + SHRINKAGE * overall[:, None]) / (counts.sum(axis=1) + SHRINKAGE)
    means: Floats = (rewards + SHRINKAGE * by_action[:, None, :]) / (counts + SHRINKAGE)
    return means


def _half_width(influence: Floats, group: NDArray[np.int64]) -> float | None:
    """Return half of the 95 % interval of a mean, from each decision's influence; None with fewer than two groups."""
    try:
        from scipy import stats
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    _, number = np.unique(group, return_inverse=True)
    if number.max() + 1 < PARTICIPANTS:
        number = np.arange(len(influence))
    sums = np.bincount(number, weights=influence)
    groups = len(sums)
    if groups < 2:
        return None
    error = np.sqrt(groups / (groups - 1) * (sums**2).sum()) / len(influence)
    return float(stats.t.ppf(0.975, groups - 1) * error)
