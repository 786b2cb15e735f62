"""Checks of a study whose values each follow their rule. Pure.

Mistakes are refused when a study is read from a file or given at a start; recordings and sessions of earlier versions
keep what they have. Warnings are plain sentences for the researcher; nothing is refused because of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from shift_model.thresholds import below
from shift_model.vocabulary import TRIPLES

from shift_study.area_checks import area_warnings
from shift_study.learner_settings import COMMON, LEARNER_SETTINGS, LearnerSettings, parameters_of
from shift_study.loading import study_in_force
from shift_study.phrase_checks import phrase_warnings
from shift_study.scoring import scores
from shift_study.scoring_table import ScoringTable
from shift_study.study import Study


class Plausible(NamedTuple):
    """The quantity of a value, and the range outside of which its unit is probably wrong."""

    meaning: str
    low: float
    high: float
    smaller: str
    """The unit that is often written by mistake."""
    factor: float
    """How many of ours one of it is."""


PLAUSIBLE: dict[str, Plausible] = {
    "fixation.screen_width_cm": Plausible("the width of the stimulus in cm", 5, 300, "mm", 0.1),
    "fixation.screen_height_cm": Plausible("the height of the stimulus in cm", 5, 200, "mm", 0.1),
    "fixation.distance_cm": Plausible("the distance from eye to screen in cm", 20, 300, "mm", 0.1),
    "fixation.dispersion_deg": Plausible("the extent of a fixation in degrees", 0.1, 10, "pixels", 0.0),
    "fixation.minimum_duration_s": Plausible("the shortest fixation in seconds", 0.02, 1, "ms", 1e-3),
    "fixation.median_filter_s": Plausible("the window of a filter in seconds", 0, 0.2, "ms", 1e-3),
    "fixation.maximum_gap_s": Plausible("the longest loss inside a fixation in seconds", 0.01, 1, "ms", 1e-3),
    "attention.step_s": Plausible("dwell in seconds", 0.001, 10, "ms", 1e-3),
    "attention.maximum_dwell_s": Plausible("dwell in seconds", 0.02, 60, "ms", 1e-3),
    "attention.minimum_dwell_s": Plausible("dwell in seconds", 0, 30, "ms", 1e-3),
    "reward.decay": Plausible("the decay of the reward per second", 0, 10, "", 0.0),
    "decider.wait_s": Plausible("a wait in seconds", 0, 60, "ms", 1e-3),
}
"""Chosen wide: a value outside is probably in another unit."""


def study_warnings(study: Study) -> tuple[str, ...]:
    """Return warnings as sentences: those of the study's own values, then those of each condition."""
    found = [*area_warnings(study.aois, study.fixation), *_warnings_in_force(study)]
    for condition in study.conditions:
        more = _warnings_in_force(study_in_force(study, condition))
        found += [f"condition {condition}: {sentence}" for sentence in more if sentence not in found]
    return (*found, *_unused_parameters(study))


def _warnings_in_force(study: Study) -> list[str]:
    found = [*_implausible(study), *_shares_in_table(study.scoring.table), *_levels_out_of_reach(study)]
    return found + _silences(study)


def _silences(study: Study) -> list[str]:
    return [] if study.phrases is None else [*phrase_warnings(study.phrases, study.tasks, study.scoring)]


def _implausible(study: Study) -> Iterator[str]:
    for path, expected in PLAUSIBLE.items():
        part, key = path.split(".")
        value = getattr(getattr(study, part), key)
        if expected.low <= value <= expected.high:
            continue
        said = f"{path} is {value:g}: {expected.meaning} is plausible from {expected.low:g} to {expected.high:g}"
        meant = value * expected.factor
        hint = f"; if {value:g} {expected.smaller} are meant, write {meant:g}"
        yield said + (hint if expected.factor and expected.low <= meant <= expected.high else "")


def _shares_in_table(table: ScoringTable) -> Iterator[str]:
    odd = [
        f"{part}.{category}.{name} is {entry:g}"
        for part in ScoringTable.model_fields
        for category, row in getattr(table, part)
        for name, entry in row.items()
        if entry not in (0, 1)
    ]
    if odd:
        more = f" and {len(odd) - 5} more" if len(odd) > 5 else ""
        yield (
            f"scoring.table: {', '.join(odd[:5])}{more}; the paper's table has 0 or 1 for each category and strategy, "
            "and an entry between them counts as that share"
        )


def _levels_out_of_reach(study: Study) -> Iterator[str]:
    reached = [scores(study.scoring, triple) for triple in TRIPLES]
    for name, strategy in study.scoring.strategies.items():
        largest = max(score[name] for score in reached)
        for level, threshold in zip(strategy.levels[1:], strategy.thresholds, strict=True):
            if below(largest, threshold):
                yield (
                    f"scoring.strategies.{name}: the scoring system never suggests {level}, since its threshold is "
                    f"{threshold:g} and the largest score is {largest:g}"
                )


# --- parameters without effect ---


def _unused_parameters(study: Study) -> Iterator[str]:
    """The study's own parameters serve all of its conditions; a condition's serve its own learner."""
    in_force = {name: study_in_force(study, name).learner for name in study.conditions}
    learners = {study.learner.name, *(settings.name for settings in in_force.values())}
    for key in _given(study.learner):
        if not any(key in parameters_of(name) for name in learners):
            yield _no_effect(f"learner.{key}", sorted(learners), key)
    for condition, settings in in_force.items():
        for key in _written(study.conditions[condition].get("learner")):
            if key not in parameters_of(settings.name):
                yield _no_effect(f"conditions.{condition}.learner.{key}", [settings.name], key)


def _given(settings: LearnerSettings) -> list[str]:
    """Return the parameters that were written; if all are written, those that differ from their default."""
    parameters = [key for key in LearnerSettings.model_fields if key not in COMMON]
    written = [key for key in parameters if key in settings.model_fields_set]
    with_value = [key for key in parameters if LearnerSettings.model_fields[key].default is not None]
    if not set(with_value) <= set(written):
        return written
    return [key for key in parameters if getattr(settings, key) != LearnerSettings.model_fields[key].default]


def _written(patch: Any) -> list[str]:
    return (
        [key for key, value in patch.items() if key not in COMMON and value is not None]
        if isinstance(patch, dict)
        else []
    )


def _no_effect(path: str, learners: list[str], key: str) -> str:
    readers = [name for name in LEARNER_SETTINGS if key in parameters_of(name)]
    return f"{path} has no effect: {', '.join(learners)} does not read it; it is a parameter of {', '.join(readers)}"
