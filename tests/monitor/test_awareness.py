"""Task awareness, compared with a loop over all results."""

from __future__ import annotations

import random

import pytest
from shift_monitor.awareness import HISTORY_LENGTH, History, add_result, awareness_view, correct_result
from shift_schemas.messages import Performance
from support.monitor_sessions import config, configured_session, fold, last, performance, study


@pytest.mark.parametrize(
    ("comprehension", "enabledness", "category"),
    [
        (False, False, "failure"),
        (True, False, "misconception_enabledness"),
        (False, True, "misconception_comprehension"),
        (True, True, "success"),
    ],
)
def test_awareness_class_follows_the_last_result(comprehension: bool, enabledness: bool, category: str) -> None:
    _, facts = fold(configured_session(), performance(1, True, True), performance(2, comprehension, enabledness))
    assert last(facts).awareness["grasp"].category == category
    assert last(facts).awareness["grasp"].results == 2


def test_task_without_results_is_unknown() -> None:
    assert awareness_view(History(), 1, 0.5).category == "unknown"
    _, facts = fold(configured_session(), performance(1, True, True, task="pour"))
    assert set(last(facts).awareness) == {"pour"}


@pytest.mark.parametrize("window", [1, 2, 3, 7])
@pytest.mark.parametrize("threshold", [0.3, 0.5, 2 / 3])
def test_ratios_match_a_loop_over_the_window(window: int, threshold: float) -> None:
    rng = random.Random(window)
    history, results = History(), []
    for n in range(1, 40):
        result = (rng.random() < 0.5, rng.random() < 0.5)
        results.append(result)
        history = add_result(history, performance(n, *result))
        recent = results[-window:]
        ratios = [sum(r[i] for r in recent) / len(recent) for i in (0, 1)]
        view = awareness_view(history, window, threshold)
        assert [view.comprehension, view.enabledness] == ratios
        words = {(0, 0): "failure", (1, 0): "misconception_enabledness", (0, 1): "misconception_comprehension"}
        fine = (int(ratios[0] >= threshold - 1e-9), int(ratios[1] >= threshold - 1e-9))
        assert view.category == words.get(fine, "success")


def test_longer_window_includes_earlier_results() -> None:
    wider = study(awareness={"window": 3, "threshold": 0.6})
    results = [performance(1, True, True), performance(2, True, False), performance(3, False, False)]
    _, facts = fold(configured_session(), *results, config(wider, version=2))
    view = last(facts).awareness["grasp"]
    assert view.comprehension == pytest.approx(2 / 3)
    assert view.category == "misconception_enabledness"


def test_history_is_bounded() -> None:
    history = History("1" * HISTORY_LENGTH, "1" * HISTORY_LENGTH, HISTORY_LENGTH)
    longer = add_result(history, performance(1, False, True))
    assert len(longer.comprehension) == HISTORY_LENGTH
    assert longer.comprehension.endswith("0")
    assert longer.results == HISTORY_LENGTH + 1


def test_correction_replaces_the_corrected_result() -> None:
    history = History()
    for n, success in enumerate((True, False, True), start=1):
        history = add_result(history, result(n, success))
    after = correct_result(history, result(4, True, of=2))
    assert (after.comprehension, after.enabledness, after.results) == ("111", "111", 3)
    assert correct_result(after, result(5, False, of=3)).comprehension == "110"


def test_correction_of_a_forgotten_result_changes_nothing() -> None:
    history = History("01", "01", results=12)
    assert correct_result(history, result(13, True, of=10)) == history
    assert correct_result(history, result(13, True, of=11)).comprehension == "11"


def result(n: int, success: bool, of: int = 0) -> Performance:
    performed = performance(n, success, success)
    return performed.model_copy(update={"corrects": of > 0, "result": of or n})
