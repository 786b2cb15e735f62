"""Task awareness: the history of one task's results (paper, section III-A3). Pure.

The ratios and the classes are in ``shift_model.awareness``. The history is as long as the longest window that a
study can ask for, because the window can change while a session runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from shift_model.awareness import awareness_class, success_ratio
from shift_schemas.messages import AwarenessView, Performance
from shift_study.constants import AwarenessSettings

HISTORY_LENGTH = 10_000
"""The largest ``awareness.window`` of a study (shift_study.study)."""


@dataclass(frozen=True, slots=True)
class History:
    """The results of one task: for each dimension one character per result, the newest last; ``1`` is a success."""

    comprehension: str = ""
    enabledness: str = ""
    results: int = 0


def add_result(history: History, performance: Performance) -> History:
    """Return the history with one more result."""
    return History(
        (history.comprehension + _mark(performance.comprehension.success))[-HISTORY_LENGTH:],
        (history.enabledness + _mark(performance.enabledness.success))[-HISTORY_LENGTH:],
        history.results + 1,
    )


def correct_result(history: History, performance: Performance) -> History:
    """Return the history with one result replaced, or unchanged if that result is older than the history."""
    at = performance.result - 1 - (history.results - len(history.comprehension))
    if at < 0:
        return history
    return History(
        _replace_mark(history.comprehension, at, performance.comprehension.success),
        _replace_mark(history.enabledness, at, performance.enabledness.success),
        history.results,
    )


@lru_cache(maxsize=4096)
def awareness_view(history: History, window: int, threshold: float) -> AwarenessView:
    """Return the class and the success ratio of each dimension over the last ``window`` results.

    The view is cached: every chunk of gaze asks for it, and only a result changes it.
    """
    comprehension = success_ratio(history.comprehension, window)
    enabledness = success_ratio(history.enabledness, window)
    return AwarenessView(
        category=awareness_class(comprehension, enabledness, threshold) if history.results else "unknown",
        comprehension=comprehension,
        enabledness=enabledness,
        results=history.results,
    )


def awareness_views(histories: dict[str, History], settings: AwarenessSettings) -> dict[str, AwarenessView]:
    """Return the view of each task that has results."""
    return {task: awareness_view(h, settings.window, settings.threshold) for task, h in histories.items()}


def _mark(success: bool) -> str:
    return "1" if success else "0"


def _replace_mark(marks: str, at: int, success: bool) -> str:
    return marks[:at] + _mark(success) + marks[at + 1 :]
