"""Task awareness against a loop over all results."""

from __future__ import annotations

import random

import pytest
from shift_monitor.awareness import HISTORY_LENGTH, History, awareness_view, corrected, reported
from shift_schemas.messages import Performance
from support.monitor_sessions import began, config, fold, last, performance, study


@pytest.mark.parametrize(
    ("comprehension", "enabledness", "category"),
    [
        (False, False, "failure"),
        (True, False, "misconception_enabledness"),
        (False, True, "misconception_comprehension"),
        (True, True, "success"),
    ],
)
def test_the_class_is_that_of_the_last_result(comprehension: bool, enabledness: bool, category: str) -> None:
    _, facts = fold(began(), performance(1, True, True), performance(2, comprehension, enabledness))
    assert last(facts).awareness["grasp"].category == category
    assert last(facts).awareness["grasp"].results == 2


def test_a_task_without_results_is_unknown() -> None:
    assert awareness_view(History(), 1, 0.5).category == "unknown"
    _, facts = fold(began(), performance(1, True, True, task="pour"))
    assert set(last(facts).awareness) == {"pour"}


@pytest.mark.parametrize("window", [1, 2, 3, 7])
@pytest.mark.parametrize("threshold", [0.3, 0.5, 2 / 3])
def test_ratios_are_those_of_a_loop_over_the_window(window: int, threshold: float) -> None:
    rng = random.Random(window)
    history, results = History(), []
    for n in range(1, 40):
        result = (rng.random() < 0.5, rng.random() < 0.5)
        results.append(result)
        history = reported(history, performance(n, *result))
        recent = results[-window:]
        ratios = [sum(r[i] for r in recent) / len(recent) for i in (0, 1)]
        view = awareness_view(history, window, threshold)
        assert [view.comprehension, view.enabledness] == ratios
        words = {(0, 0): "failure", (1, 0): "misconception_enabledness", (0, 1): "misconception_comprehension"}
        fine = (int(ratios[0] >= threshold - 1e-9), int(ratios[1] >= threshold - 1e-9))
        assert view.category == words.get(fine, "success")


def test_a_window_that_is_made_longer_looks_further_back() -> None:
    wider = study(awareness={"window": 3, "threshold": 0.6})
    results = [performance(1, True, True), performance(2, True, False), performance(3, False, False)]
    _, facts = fold(began(), *results, config(wider, version=2))
    view = last(facts).awareness["grasp"]
    assert view.comprehension == pytest.approx(2 / 3)
    assert view.category == "misconception_enabledness"


def test_the_history_is_bounded() -> None:
    history = History("1" * HISTORY_LENGTH, "1" * HISTORY_LENGTH, HISTORY_LENGTH)
    longer = reported(history, performance(1, False, True))
    assert len(longer.comprehension) == HISTORY_LENGTH
    assert longer.comprehension.endswith("0")
    assert longer.results == HISTORY_LENGTH + 1


def test_a_correction_takes_the_place_of_the_result_that_it_corrects() -> None:
    history = History()
    for n, success in enumerate((True, False, True), start=1):
        history = reported(history, result(n, success))
    after = corrected(history, result(4, True, of=2))
    assert (after.comprehension, after.enabledness, after.results) == ("111", "111", 3)
    assert corrected(after, result(5, False, of=3)).comprehension == "110"


def test_a_correction_of_a_result_that_the_history_forgot_changes_nothing() -> None:
    history = History("01", "01", results=12)
    assert corrected(history, result(13, True, of=10)) == history
    assert corrected(history, result(13, True, of=11)).comprehension == "11"


def result(n: int, success: bool, of: int = 0) -> Performance:
    told = performance(n, success, success)
    return told.model_copy(update={"corrects": of > 0, "result": of or n})
