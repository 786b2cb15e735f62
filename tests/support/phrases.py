"""Studies with phrases, for the tests of the study's room."""

from __future__ import annotations

from typing import Any

import pytest
from shift_schemas.errors import InvalidStudy
from shift_study.loading import given_study
from shift_study.phrases import text_for
from shift_study.study import Study

NEGATION = ("affirmation", "negation_affirmation", "negation")
GESTURE = {
    "strategies": {"gesture": {"levels": ["none", "pointing"], "thresholds": [0.5]}},
    "table": {
        "capacity": {"low": {"gesture": 1}, "high": {"gesture": 0}},
        "gaze": {"distracted": {"gesture": 1}, "uncertain": {"gesture": 1}, "focused": {"gesture": 0}},
        "awareness": {
            "unknown": {"gesture": 0}, "failure": {"gesture": 1}, "misconception_enabledness": {"gesture": 0},
            "misconception_comprehension": {"gesture": 1}, "success": {"gesture": 0},
        },
    },
}  # fmt: skip
"""A third strategy, with a level that has the name of a level of hesitation."""
THREE = {"affirmation": "take {it}.", "negation_affirmation": "not {that}, {it}.", "negation": "not {that}."}
WORDS = {"it": "the blue cup", "that": "the red cup"}


def study(phrases: Any, **parts: Any) -> Study:
    """A study with these phrases."""
    return given_study({"study": "x", "tasks": ["grasp", "turn"], "phrases": phrases, **parts})


def said(given: Study, task: str, *levels: str) -> str | None:
    """The text for a task and one level of each strategy."""
    return text_for(given.phrases, task, dict(zip(given.scoring.strategies, levels, strict=True)))


def mistake(phrases: Any, **parts: Any) -> str:
    """What is said of phrases with a mistake."""
    with pytest.raises(InvalidStudy) as refused:
        study(phrases, **parts)
    return refused.value.detail
