"""How many sessions a study needs, from simulation: to compare two conditions, or to judge a policy by what-if.

Simulated people use both policies. Each person is drawn from families that differ from the scoring table in different
ways (:mod:`shift_simulator.generated_users`), or is one of the given users. The outcome of a session is its mean
reward. The power is that of Student's t test at 5 %, two-sided: for two groups of different people, and for the
differences within sessions that a what-if estimates. How real people differ from the simulated ones is not known, so
the numbers are a guide and no promise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from shift_recording.parallel import for_each
from shift_schemas.errors import InvalidSettings
from shift_schemas.lifecycle import LIVE
from shift_schemas.messages import FORMAT, Config, ReportPerformance, Result, Session
from shift_schemas.timestamps import Stamp
from shift_simulator.generated_users import FAMILIES
from shift_simulator.session import SESSION, Episode, play
from shift_simulator.users import User
from shift_study.loading import study_from_json

from shift_analysis.counterfactual import Alternative, OtherDecider
from shift_analysis.off_policy import EXTRA, LoggedDecisions, doubly_robust_terms

ALPHA = 0.05
MOST = 10_000
"""More sessions than anybody records."""
NUMBERS = (5, 10, 20, 40, 80, 160)
"""For these numbers of sessions the power is printed."""
SMALLEST_EFFECT = 1e-9


@dataclass(frozen=True)
class PlannedSession:
    """One simulated session under the first policy, and the same person's session under the second one.

    The lists have one entry for each decision of the first session: what off-policy evaluation needs.
    """

    reward: float
    """The mean reward of a decision under the first policy."""
    other_reward: float
    """The mean reward of a decision of the same person under the second policy."""
    rewards: list[float]
    states: list[str]
    actions: list[int]
    propensities: list[float]
    other_probabilities: list[list[float]]
    supported: list[bool]
    """Whether everything that the second policy could have chosen had a probability above 0."""


@dataclass(frozen=True)
class PlannedStudy:
    """The two policies as studies in JSON, and who takes part."""

    study: str
    other: str
    users: tuple[User, ...] = ()
    """The people, in turns; empty: people from the families of generated users."""
    interactions: int = 0
    """How many interactions a session has; 0: as many as the study plans."""

    def person(self, seed: int) -> User:
        """Return the person of a session."""
        if self.users:
            return self.users[seed % len(self.users)]
        rng = np.random.default_rng(seed)
        return FAMILIES[sorted(FAMILIES)[seed % len(FAMILIES)]](rng)


def simulate_planned(planned: PlannedStudy, seed: int) -> PlannedSession:
    """Simulate one session under both policies, and decide the first one again under the second policy."""
    study, other = study_from_json(planned.study), study_from_json(planned.other)
    episodes = planned.interactions or study.interactions
    person = planned.person(seed)
    played = list(play(person, study, seed, episodes))
    elsewhere = [episode.performance.reward for episode in play(person, other, seed, episodes)]
    again = _decided_again(planned, played, seed)
    rewards = [episode.performance.reward for episode in played]
    return PlannedSession(
        reward=float(np.mean(rewards)), other_reward=float(np.mean(elsewhere)), rewards=rewards,
        states=[episode.decision.cognitive_state for episode in played],
        actions=[episode.action for episode in played],
        propensities=[episode.decision.propensity or 0.0 for episode in played],
        other_probabilities=[list(row) for row in again],
        supported=[
            all(p > 0 for p, q in zip(episode.decision.probabilities, row, strict=True) if q > 0)
            for episode, row in zip(played, again, strict=True)
        ],
    )  # fmt: skip


def _decided_again(planned: PlannedStudy, played: Sequence[Episode], seed: int) -> Iterator[list[float]]:
    """Return the second policy's probabilities at each decision of a session under the first policy."""
    now = Stamp.of(0)
    begun = Session(
        session=SESSION, stamp=now, participant="P00", study=study_from_json(planned.study).study, seed=seed,
        state=LIVE, started=now, format=FORMAT,
    )  # fmt: skip
    observations = {episode.observation.version: episode.observation for episode in played}
    shadow = OtherDecider(begun, Alternative(study_of=lambda _: planned.other), observations)
    shadow.take(begun, now, 0)
    shadow.take(Config(session=SESSION, stamp=now, version=1, study=planned.study), now, 1)
    for episode in played:
        decision, performance = episode.decision, episode.performance
        shadow.take(decision, now, 2 * decision.n)
        scored = (performance.comprehension, performance.enabledness)
        comprehension, enabledness = (Result(success=s.success, duration_s=s.duration_s) for s in scored)
        report = ReportPerformance(
            command_id=decision.decision_id, session=SESSION, comprehension=comprehension, enabledness=enabledness
        )
        shadow.take(report, now, 2 * decision.n + 1)
    return [each.other.probabilities for each in shadow.decisions]  # type: ignore[return-value]


def simulate_all(
    planned: PlannedStudy, sessions: int, seed: int, workers: int = 0, scheduler: str = ""
) -> Iterator[PlannedSession]:
    """Yield so many simulated sessions; each has a seed of its own, from ``seed`` on."""
    seeds = [seed * MOST + i for i in range(sessions)]
    yield from for_each(partial(simulate_planned, planned), seeds, workers, scheduler)


# --- power ---


@dataclass(frozen=True)
class Need:
    """How many sessions a question needs.

    ``effect`` is the standardised difference (Cohen's d). ``sessions`` is None if more than :data:`MOST` are needed.
    """

    difference: float
    sd: float
    effect: float
    sessions: int | None
    power: dict[int, float]

    def as_json(self) -> dict[str, Any]:
        """Return the answer as ``--json`` prints it."""
        return {
            "difference": self.difference, "sd": self.sd, "effect": self.effect, "sessions": self.sessions,
            "power": {str(n): power for n, power in self.power.items()},
        }  # fmt: skip


def need(difference: float, sd: float, power: float, of: Callable[[float, int], float]) -> Need:
    """Return how many sessions have the wanted power; ``of(effect, sessions)`` computes the power of a design."""
    effect = abs(difference) / sd if sd > 0 else math.inf if difference else 0.0
    numbers = {n: of(effect, n) for n in NUMBERS}
    if effect < SMALLEST_EFFECT:
        return Need(difference, sd, effect, None, numbers)
    low, high = 1, MOST + 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if of(effect, middle) >= power else (middle, high)
    return Need(difference, sd, effect, high if high <= MOST else None, numbers)


def power_of_two_groups(effect: float, sessions: int) -> float:
    """Return the power to tell two groups of so many sessions each apart."""
    return _power(effect * math.sqrt(sessions / 2), 2 * sessions - 2)


def power_of_differences(effect: float, sessions: int) -> float:
    """Return the power to tell a mean difference within so many sessions from 0."""
    return _power(effect * math.sqrt(sessions), sessions - 1)


def _power(noncentrality: float, freedom: int) -> float:
    try:
        from scipy import stats
    except ImportError as e:
        raise InvalidSettings(EXTRA) from e
    if freedom < 1:
        return 0.0
    limit = stats.t.ppf(1 - ALPHA / 2, freedom)
    upper = stats.nct.sf(limit, freedom, noncentrality)
    lower = stats.nct.cdf(-limit, freedom, noncentrality)
    # Far out scipy gives NaN: then the upper tail is 1, and the lower one 0, to more digits than are printed.
    return float(np.nan_to_num(upper, nan=1.0) + np.nan_to_num(lower, nan=0.0))


# --- the answer ---


@dataclass(frozen=True)
class Plan:
    """The answer to how many sessions are needed."""

    simulated: int
    means: tuple[float, float]
    sds: tuple[float, float]
    comparison: Need
    """Two groups of different people, one for each policy; ``sessions`` is the size of each group."""
    whatif: Need
    """Sessions under the first policy only, and the second policy judged by the doubly robust estimator."""
    support: float
    """The share of the decisions in which what-if can answer."""
    warnings: list[str]

    def as_json(self) -> dict[str, Any]:
        """Return the answer as ``--json`` prints it."""
        return {
            "simulated": self.simulated, "means": list(self.means), "sds": list(self.sds),
            "comparison": self.comparison.as_json(), "whatif": self.whatif.as_json(), "support": self.support,
            "warnings": self.warnings,
        }  # fmt: skip


def plan_of(sessions: Sequence[PlannedSession], power: float) -> Plan:
    """Return how many sessions give the wanted power."""
    first = np.array([session.reward for session in sessions])
    second = np.array([session.other_reward for session in sessions])
    pooled = math.sqrt((first.var(ddof=1) + second.var(ddof=1)) / 2)
    logged = _logged(sessions)
    gains = _mean_by_group(doubly_robust_terms(logged) - logged.reward, logged.group)
    supported = [yes for session in sessions for yes in session.supported]
    support = sum(supported) / len(supported)
    comparison = need(float(second.mean() - first.mean()), pooled, power, power_of_two_groups)
    whatif = need(float(gains.mean()), float(gains.std(ddof=1)), power, power_of_differences)
    return Plan(
        simulated=len(sessions), means=(float(first.mean()), float(second.mean())),
        sds=(float(first.std(ddof=1)), float(second.std(ddof=1))), comparison=comparison, whatif=whatif,
        support=support, warnings=list(_warnings(comparison, whatif, support)),
    )  # fmt: skip


def _logged(sessions: Sequence[PlannedSession]) -> LoggedDecisions:
    states = sorted({state for session in sessions for state in session.states})
    return LoggedDecisions(
        reward=np.array([r for session in sessions for r in session.rewards]),
        action=np.array([a for session in sessions for a in session.actions]),
        propensity=np.array([p for session in sessions for p in session.propensities]),
        other=np.array([row for session in sessions for row in session.other_probabilities]),
        state=np.array([states.index(state) for session in sessions for state in session.states]),
        group=np.repeat(np.arange(len(sessions)), [len(session.rewards) for session in sessions]),
    )


def _mean_by_group(values: np.ndarray[Any, Any], group: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    means: np.ndarray[Any, Any] = np.bincount(group, weights=values) / np.bincount(group)
    return means


def _warnings(comparison: Need, whatif: Need, support: float) -> Iterator[str]:
    if support < 1:
        yield (
            f"in {100 * (1 - support):.1f} % of the decisions the other policy could choose a strategy that the study "
            "never chooses there, so what-if has no answer and its number of sessions is not to be relied on. "
            "decider.minimum_propensity in the study prevents this"
        )
    for name, found in (("a comparison of two groups", comparison), ("a what-if", whatif)):
        if found.sessions is None:
            yield f"the simulated difference is so small that {name} needs more than {MOST} sessions"
