"""Task awareness: success ratios of both dimensions and their class (paper, section III-A3). Pure."""

from __future__ import annotations

from shift_model.thresholds import reaches
from shift_model.vocabulary import AwarenessClass

CLASSES: dict[tuple[bool, bool], AwarenessClass] = {
    (False, False): "failure",
    (True, False): "misconception_enabledness",
    (False, True): "misconception_comprehension",
    (True, True): "success",
}
"""The class by whether the ratios of (comprehension, enabledness) reach the threshold."""


def success_ratio(results: str, window: int) -> float:
    """Return the share of successes among the last ``window`` results; 0 without any result.

    ``results`` has one character for each result, the newest last; ``1`` is a success.
    """
    recent = results[-window:]
    return recent.count("1") / len(recent) if recent else 0.0


def awareness_class(comprehension: float, enabledness: float, threshold: float) -> AwarenessClass:
    """Return the class of a task that has results, by the success ratio of each dimension.

    A task without results is ``unknown``; the caller knows whether there are any.
    """
    return CLASSES[reaches(comprehension, threshold), reaches(enabledness, threshold)]
