"""The words of the page: how a strategy is said to the experimenter, and how numbers and times are written. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

from shift_schemas.messages import Decision, Strategy, TripleView
from shift_schemas.timestamps import NS

SPOKEN = {
    "affirmation": "affirmation",
    "negation_affirmation": "negation + affirmation",
    "negation": "negation",
    "none": "",
    "hesitation": "“um”",
}
"""The paper's levels as they are read aloud; a study's further levels are shown as the study writes them."""
SOURCES = {
    "learner": "learner",
    "last_policy": "learner’s last policy (the newest did not come in time)",
    "scoring": "scoring system (the learner has no policy yet)",
    "override": "override",
}
"""Where a decision's strategy came from."""


def spoken(strategy: Strategy) -> str:
    """Return the strategy as the experimenter reads it, such as ``negation + affirmation, “um”``."""
    words = [SPOKEN.get(level, level) for level in strategy.values()]
    return ", ".join(word for word in words if word)


def levels(strategy: Mapping[str, str]) -> str:
    """Return the levels as messages and recordings name them, such as ``negation_affirmation, hesitation``."""
    return ", ".join(strategy.values())


def origin(decision: Decision) -> str:
    """Return where a decision came from, such as ``learner, p 0.41``."""
    parts = [SOURCES[decision.policy_source]]
    if decision.propensity is not None:
        parts.append(f"p {decision.propensity:.2f}")
    if decision.explored:
        parts.append("explored")
    if decision.stale:
        parts.append("made with an old observation")
    return ", ".join(parts)


def reasons(triple: TripleView) -> str:
    """Return the three observations that a cognitive state follows from."""
    return f"capacity {triple.capacity} + gaze {triple.gaze} + awareness {triple.awareness}"


def duration(seconds: float) -> str:
    """Return a duration as minutes and seconds, ``12:41``, or with hours, ``1:02:03``."""
    whole = max(int(seconds), 0)
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def clock_time(ns: int) -> str:
    """Return the time of day on this machine, ``14:03:59``."""
    return datetime.fromtimestamp(ns / NS).strftime("%H:%M:%S")


def date_and_time(ns: int) -> str:
    """Return date and time on this machine, ``2026-11-26 14:03``."""
    return datetime.fromtimestamp(ns / NS).strftime("%Y-%m-%d %H:%M")
