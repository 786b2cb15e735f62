"""A recording decided again: unchanged it is the same, and otherwise what a session under the other study would be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from shift_analysis.counterfactual import Alternative, Redecider
from shift_analysis.whatif import OtherPolicy, compare_recording, compare_recordings, what_if
from shift_schemas.errors import InvalidStudy, MalformedMessage
from shift_schemas.messages import GazeChunk, Performance, ReportPerformance, Result
from shift_study.loading import given_study, study_json
from shift_verify.verify import verify
from support.verify_sessions import Session

KEPT = sorted((Path(__file__).parents[1] / "data").glob("v0.*/*.mcap"))
FREE = {"demanding_cost": 0.0, "other_cost": 0.0}
"""With these costs the capacity does not depend on the strategies, so that two sessions can have the same inputs."""


def scripted(folder: Path, study: dict[str, Any], interactions: int = 25) -> Path:
    """Record a session whose inputs do not depend on the study: gaze, a decision and its report in turns."""
    folder.mkdir(parents=True, exist_ok=True)
    session = Session({"capacity": FREE, **study})
    session.deliver()
    for n in range(1, interactions + 1):
        t = [n + i / 10 for i in range(8)]
        names = [["left", "middle", "right"][(n * i // 5) % 3] for i in range(8)]
        session.do("monitor", GazeChunk(source="tx", seq=n - 1, t=t, aoi=names))  # type: ignore[arg-type]
        session.answered = session.answered.model_copy(update={"gaze": {"tx": n - 1}})
        session.deliver()
        session.rng.seed(n)
        session.decide(n, timed_out=False)
        session.deliver()
        session.rng.seed(n)
        session.report(n)
        session.deliver()
    return session.ended().finished(folder)


@pytest.mark.parametrize("seed", range(8))
def test_same_policy_decides_the_same(seed: int, tmp_path: Path) -> None:
    path = Session(seed=seed, steady=seed % 2 == 0).interactions(40).ended().finished(tmp_path)
    found = compare_recording(path, OtherPolicy())
    assert found.problem == ""
    assert len(found.decisions) == 40
    assert any(each.source == "override" for each in found.decisions)
    for each in found.decisions:
        assert each.other_action == each.own
        assert each.other_probabilities == each.probabilities
        assert each.other_state == each.state
        assert (each.action == each.own) or each.source == "override"


@pytest.mark.parametrize("path", KEPT, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_kept_recordings_of_earlier_versions_decide_the_same(path: Path) -> None:
    found = compare_recording(path, OtherPolicy())
    assert found.problem == ""
    assert all(each.other_action == each.own for each in found.decisions)
    assert all(each.other_probabilities == each.probabilities for each in found.decisions)


def test_scoring_chooses_what_was_suggested(tmp_path: Path) -> None:
    path = Session(seed=3).interactions(40).ended().finished(tmp_path)
    redecider = Redecider([OtherPolicy(learner="scoring").alternative(None)])
    assert verify(path, observers=redecider.observers).ok
    found = redecider.decisions(0)
    assert len(found) == 40
    assert all(each.other.strategy == each.logged.suggested for each in found)


@pytest.mark.parametrize(
    "other",
    [
        {"learner": {"name": "scoring"}, "attention": {"maximum_dwell_s": 0.3, "minimum_dwell_s": 0.0}},
        {"learner": {"name": "scoring"}, "awareness": {"window": 3}},
        {"learner": {"name": "scoring"}, "scoring": {"strategies": {"negation": {"weight": 3.0}}}},
    ],
)
def test_other_study_decides_as_a_session_under_it(other: dict[str, Any], tmp_path: Path) -> None:
    """The learner scoring does not learn, so a session under the other study has the same situations."""
    recorded = scripted(tmp_path / "recorded", {})
    real = compare_recording(scripted(tmp_path / "real", other), OtherPolicy())
    given = study_json(given_study({"study": "test", "tasks": ["a", "b"], "capacity": FREE, **other}))
    found = compare_recording(recorded, OtherPolicy(given))
    assert [each.other_state for each in found.decisions] == [each.state for each in real.decisions]
    assert [each.other_action for each in found.decisions] == [each.action for each in real.decisions]
    assert any(each.differs for each in found.decisions)


def test_condition_of_the_session_holds(tmp_path: Path) -> None:
    conditions = {"plain": {"learner": {"name": "scoring"}}, "adaptive": {"learner": {"name": "thompson"}}}
    study = study_json(given_study({"study": "test", "tasks": ["a", "b"], "conditions": conditions}))
    path = Session(seed=4).interactions(10).ended().finished(tmp_path)
    found = []
    for condition in conditions:
        redecider = Redecider([OtherPolicy(study).alternative(condition)])
        verify(path, observers=redecider.observers)
        found.append(redecider.decisions(0))
    plain, adaptive = ([max(each.other.probabilities) for each in decisions] for decisions in found)
    assert all(p == 1 for p in plain)
    assert all(p < 1 for p in adaptive)


def test_reward_is_that_of_the_last_report(tmp_path: Path) -> None:
    session = Session(seed=5).interactions(5)
    before = session.states["learner"].reported["d2"].performance
    results = [Result(success=not before.comprehension.success, duration_s=1.0)] * 2
    again = ReportPerformance(
        command_id="again", session="s1", corrects="d2", comprehension=results[0], enabledness=results[1]
    )
    corrected = session.do("learner", again)[0]
    assert isinstance(corrected, Performance)
    redecider = Redecider([Alternative()])
    assert verify(session.ended().finished(tmp_path), observers=redecider.observers).ok
    rewards = {each.logged.decision_id: each.reward for each in redecider.decisions(0)}
    assert rewards["d2"] == corrected.reward != before.reward
    assert len(rewards) == 5


def test_other_strategies_are_refused(tmp_path: Path) -> None:
    path = Session(seed=6).interactions(5).ended().finished(tmp_path)
    levels = ["none", "hesitation", "long"]
    hesitation = {"levels": levels, "thresholds": [0.4, 0.7]}
    study = study_json(given_study({"study": "test", "scoring": {"strategies": {"hesitation": hesitation}}}))
    found = compare_recording(path, OtherPolicy(study))
    assert "has other strategies than the recording" in found.problem
    assert "hesitation: none, hesitation, long" in found.problem


def test_gaze_on_an_area_that_the_other_study_does_not_have_is_a_problem(tmp_path: Path) -> None:
    path = scripted(tmp_path, {}, interactions=3)
    aois = [{"name": "cup", "rectangle": [0.0, 0.0, 0.5, 1.0]}]
    found = compare_recording(path, OtherPolicy(study_json(given_study({"study": "test", "aois": aois}))))
    assert "cup" in found.problem
    assert "left" in found.problem


def test_unknown_learner_is_refused_with_a_proposal() -> None:
    with pytest.raises(MalformedMessage, match="did you mean 'thompson'"):
        OtherPolicy(learner="tompson")


def test_damaged_recording_does_not_stop_the_others(tmp_path: Path) -> None:
    path = Session(seed=7).interactions(10).ended().finished(tmp_path)
    damaged = tmp_path / "damaged.mcap"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    damaged.write_bytes(bytes(data))
    answer = what_if(compare_recordings([damaged, path], OtherPolicy(learner="ucb1"), workers=2))
    assert list(answer.problems) == ["damaged.mcap"]
    assert len(answer.decisions) == 10


def test_recordings_of_different_strategies_are_refused(tmp_path: Path) -> None:
    first = Session(seed=8).interactions(3).ended().finished(tmp_path)
    (tmp_path / "other").mkdir()
    hesitation = {"levels": ["none", "hesitation", "long"], "thresholds": [0.4, 0.7]}
    study = {"scoring": {"strategies": {"hesitation": hesitation}}}
    second = Session(study, seed=8).interactions(3).ended().finished(tmp_path / "other")
    with pytest.raises(InvalidStudy, match="different strategies"):
        what_if(compare_recordings([first, second], OtherPolicy(), workers=1))
