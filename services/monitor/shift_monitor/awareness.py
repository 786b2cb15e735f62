"""Task awareness: what the results of one task say (paper, section III-A3). Pure.

The history is kept as long as the longest window that a study can ask for, because the window can
change while a session runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from shift_model.vocabulary import AwarenessClass
from shift_schemas.messages import AwarenessView, Performance
from shift_study.study import AwarenessSettings

HISTORY_LENGTH = 10_000
"""The largest ``awareness.window`` of a study (shift_study.study)."""

MARGIN = 1e-9
"""Chosen, as for the other classes: a ratio this close to the threshold is at it."""

CLASSES: dict[tuple[bool, bool], AwarenessClass] = {
    (False, False): "failure",
    (True, False): "misconception_enabledness",
    (False, True): "misconception_comprehension",
    (True, True): "success",
}
"""(comprehension fine, enabledness fine) to class; a task without results is ``unknown``."""


@dataclass(frozen=True, slots=True)
class History:
    """Results of one task: per dimension one character a result, ``1`` is a success, newest last."""

    comprehension: str = ""
    enabledness: str = ""
    results: int = 0


def reported(history: History, performance: Performance) -> History:
    """The history with one more result."""
    return History(
        (history.comprehension + _mark(performance.comprehension.success))[-HISTORY_LENGTH:],
        (history.enabledness + _mark(performance.enabledness.success))[-HISTORY_LENGTH:],
        history.results + 1,
    )


def corrected(history: History, performance: Performance) -> History:
    """Return the history with one result replaced; one that is older than the history changes nothing."""
    at = performance.result - 1 - (history.results - len(history.comprehension))
    if at < 0:
        return history
    return History(
        _replaced(history.comprehension, at, performance.comprehension.success),
        _replaced(history.enabledness, at, performance.enabledness.success),
        history.results,
    )


@lru_cache(maxsize=4096)
def awareness_view(history: History, window: int, threshold: float) -> AwarenessView:
    """The class from the success ratio of each dimension over the last ``window`` results.

    Cached, for it is asked for with every chunk of gaze and changes with a result only.
    """
    comprehension = _ratio(history.comprehension, window)
    enabledness = _ratio(history.enabledness, window)
    fine = (comprehension >= threshold - MARGIN, enabledness >= threshold - MARGIN)
    return AwarenessView(
        category=CLASSES[fine] if history.results else "unknown",
        comprehension=comprehension,
        enabledness=enabledness,
        results=history.results,
    )


def awareness_views(histories: dict[str, History], settings: AwarenessSettings) -> dict[str, AwarenessView]:
    """The view of each task that has results."""
    return {task: awareness_view(h, settings.window, settings.threshold) for task, h in histories.items()}


def _mark(success: bool) -> str:
    return "1" if success else "0"


def _replaced(marks: str, at: int, success: bool) -> str:
    return marks[:at] + _mark(success) + marks[at + 1 :]


def _ratio(marks: str, window: int) -> float:
    recent = marks[-window:]
    return recent.count("1") / len(recent) if recent else 0.0
