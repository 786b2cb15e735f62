"""Planned gaze produces every gaze class, as computed by the monitor's core."""

from __future__ import annotations

from itertools import product

import pytest
from shift_model.vocabulary import GAZES, GazeClass
from shift_monitor import core
from shift_schemas.errors import InvalidSettings
from shift_schemas.messages import FORMAT, Config, Observation, Session
from shift_schemas.timestamps import Stamp
from shift_simulator.gaze_plan import chunk_of, plan_gaze
from shift_study.loading import study_json
from shift_study.study import Study

NOW = Stamp.of(0)
BEGUN = Session(session="s", stamp=NOW, participant="p", study="s", seed=1, state="live", started=NOW, format=FORMAT)


def study_with(aois: int, **attention: float) -> Study:
    names = [{"name": f"a{i}", "rectangle": [i / aois, 0.0, (i + 1) / aois, 1.0]} for i in range(aois)]
    return Study.model_validate({"study": "s", "aois": names, "attention": attention})


def classes_reached(study: Study, wanted: list[GazeClass]) -> list[GazeClass]:
    session = Session(
        session="s", stamp=NOW, participant="p", study="s", seed=1, state="live", started=NOW, format=FORMAT
    )
    state = core.step(None, session, NOW).state
    done = core.step(state, Config(session="s", stamp=NOW, version=1, study=study_json(study)), NOW)
    clock_ns, found = 0, list[GazeClass]()
    for seq, gaze in enumerate(wanted):
        observation = done.facts[-1]
        assert isinstance(observation, Observation)
        if looks := plan_gaze(study, observation.gaze, gaze):
            chunk, clock_ns = chunk_of(study, looks, "sim", seq, clock_ns)
            done = core.step(done.state, chunk, NOW)
        after = done.facts[-1]
        assert isinstance(after, Observation)
        found.append(after.gaze.category)
    return found


ALL_PAIRS = [g for pair in product(GAZES, GAZES) for g in pair] + [g for pair in product(GAZES, GAZES) for g in pair]


@pytest.mark.parametrize("aois", [2, 3, 4, 7, 12])
def test_every_class_follows_every_class(aois: int) -> None:
    assert classes_reached(study_with(aois), ALL_PAIRS) == ALL_PAIRS


@pytest.mark.parametrize(
    "attention",
    [
        {"shift_increase": 0.05, "shift_decrease": 0.2},
        {"shift_increase": 0.7},
        {"weight_step": 0.01},
        {"step_s": 0.5, "maximum_dwell_s": 0.03},
        {"weight_min": 0.1},
        {"focused_dominance": 0.8, "focused_shift": 0.1},
    ],
)
def test_plans_exist_for_other_attention_settings(attention: dict[str, float]) -> None:
    assert classes_reached(study_with(3, **attention), ALL_PAIRS) == ALL_PAIRS


def test_unreachable_gaze_class_is_refused() -> None:
    one = study_with(1)
    assert classes_reached(one, ["uncertain", "focused"]) == ["uncertain", "focused"]
    with pytest.raises(InvalidSettings, match="study s, no gaze on its 1 AOIs produces the gaze class distracted"):
        classes_reached(one, ["distracted"])


def test_plan_is_deterministic_and_empty_if_the_class_is_present() -> None:
    study = study_with(3)
    observation = core.observation_of
    session = Session(
        session="s", stamp=NOW, participant="p", study="s", seed=1, state="live", started=NOW, format=FORMAT
    )
    state = core.step(None, session, NOW).state
    state = core.step(state, Config(session="s", stamp=NOW, version=1, study=study_json(study)), NOW).state
    view = observation(state, NOW).gaze
    assert plan_gaze(study, view, "uncertain") == ()
    assert plan_gaze(study, view, "distracted") == plan_gaze(study, view, "distracted")
