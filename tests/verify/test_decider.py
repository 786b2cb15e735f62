"""Verify of the decider's outputs from format 3 on: a fold in the recorded order, which finds every changed field."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from shift_recording.mcap.reader import RecordedMessage, Recording
from shift_schemas.messages import FORMAT, Configure, Decision
from shift_schemas.registry import OWNERS
from shift_verify.decider import DeciderFold, decider_verification
from shift_verify.decider_before_format_3 import DeciderSearch
from shift_verify.difference import Difference
from shift_verify.inputs import Inputs
from shift_verify.verify import verify
from support.verify_sessions import Edit, Session, changed, rewritten, without

PLAIN = {"negation": "affirmation", "hesitation": "none"}


def another(strategy: dict[str, str]) -> dict[str, str]:
    """A strategy that differs from ``strategy``."""
    return PLAIN if strategy != PLAIN else {"negation": "negation", "hesitation": "hesitation"}


CHANGES: dict[str, Sequence[tuple[Sequence[str | int], Callable[[Any], Any]]]] = {
    "session": [(["session"], lambda v: f"{v}-other")],
    "stamp": [(["stamp", "nsec"], lambda v: (v + 1) % 10**9)],
    "seen": [
        (["seen", "observation"], lambda v: v + 1),
        (["seen", "observation"], lambda v: v - 1),
        (["seen", "config"], lambda v: v + 1),
        (["seen", "config"], lambda v: v - 1),
        (["seen", "policy"], lambda v: v - 1),
        (["seen", "policy"], lambda v: v + 1),
        (["seen", "decision"], lambda v: v + 1),
        (["seen", "performance"], lambda v: v - 1),
        (["seen", "gaze"], lambda v: {**v, "another": 1}),
    ],
    "n": [(["n"], lambda v: v + 1), (["n"], lambda v: v - 1)],
    "strategy": [(["strategy"], another)],
    "observation": [(["observation", "capacity"], lambda v: "low" if v == "high" else "high")],
    "scores": [(["scores", "negation"], lambda v: v + 1e-9)],
    "cognitive_state": [(["cognitive_state"], lambda v: "uncertain" if v != "uncertain" else "unfocused")],
    "suggested": [(["suggested"], another)],
    "actions": [(["actions", 0], another), (["actions"], lambda v: v[:-1])],
    "probabilities": [(["probabilities", 5], lambda v: v + 1e-9)],
    "propensity": [(["propensity"], lambda v: v + 1e-9)],
    "explored": [(["explored"], lambda v: not v)],
    "policy_source": [(["policy_source"], lambda v: "last_policy" if v == "learner" else "learner")],
    "versions": [
        (["versions", "observation"], lambda v: v - 1),
        (["versions", "policy"], lambda v: v + 1),
        (["versions", "config"], lambda v: v + 1),
    ],
    "stale": [(["stale"], lambda v: not v)],
    "state": [(["state"], lambda v: "uncertain" if v != "uncertain" else "unfocused")],
    "seed": [(["seed"], lambda v: v + 1)],
    "override_id": [(["override_id"], lambda v: "another")],
    "reason": [(["reason"], lambda v: "another")],
    "without_override": [(["without_override"], lambda v: {"negation": "negation", "hesitation": "none"})],
    "text": [(["text"], lambda v: "another")],
    "gaze_age_s": [(["gaze_age_s"], lambda v: v + 1e-6)],
    "gaze_valid": [(["gaze_valid"], lambda v: v - 1e-6)],
}
"""Changes of the fields that a decision derives; what it answers (id, task, what was required) is tried below."""
INPUTS = {"decision_id", "task", "required"}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """100 interactions in format 3 with late decisions, overrides and changes of the configuration."""
    return Session().interactions(100).ended().finished(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def decisions(recording: Path) -> list[dict[str, Any]]:
    """The decisions of the recording."""
    return [json.loads(m.data) for m in Recording(recording).messages({"decision"})]


@pytest.fixture(scope="module")
def plain(recording: Path) -> list[int]:
    """Indices of drawn decisions that are recorded before anything that follows from them."""
    messages = [(m.topic, json.loads(m.data)) for m in Recording(recording).messages({"decision", "policy"})]
    found, seen = [], 0
    for topic, data in messages:
        if topic == "policy":
            seen = data["seen"]["decision"]
        elif data["n"] > 20 and seen < data["n"] and "propensity" in data:
            found.append(data["n"] - 1)
    return found


def found(
    recording: Path, folder: Path, number: int, path: Sequence[str | int], change: Callable[[Any], Any]
) -> Difference:
    """The difference that verify finds when a field of the decision with index ``number`` is changed."""
    report = verify(rewritten(recording, folder / "changed", changed("decision", number, path, change)))
    assert report.checksum == "matches"
    assert report.difference is not None
    return report.difference


def test_every_derived_field_of_a_decision_is_tried() -> None:
    assert CHANGES.keys() | INPUTS == Decision.model_fields.keys()


@pytest.mark.parametrize(
    ("field", "path", "change"),
    [(field, path, change) for field, changes in CHANGES.items() for path, change in changes],
    ids=lambda v: ".".join(map(str, v)) if isinstance(v, list) else "",
)
@pytest.mark.parametrize("which", [0, 7])
def test_changed_decision_field_is_found_and_named(
    recording: Path, plain: list[int], tmp_path: Path, which: int, field: str, path: list[str | int],
    change: Callable[[Any], Any],
) -> None:  # fmt: skip
    difference = found(recording, tmp_path, plain[which], path, change)
    assert difference.subject == "decision"
    name = difference.field.split(".")[0]
    assert name == field or {name, field} == {"seen", "versions"}, "versions repeat a part of seen"
    assert difference.sentence


def test_changed_stale_is_found_in_every_decision(
    recording: Path, decisions: list[dict[str, Any]], tmp_path: Path
) -> None:
    stale = [d["n"] - 1 for d in decisions if d["stale"]]
    assert stale
    for number in [*stale, *range(0, 100, 10)]:
        difference = found(recording, tmp_path, number, ["stale"], lambda v: not v)
        assert (difference.subject, difference.field) == ("decision", "stale")


def test_changed_policy_source_is_found_in_every_decision(
    recording: Path, decisions: list[dict[str, Any]], tmp_path: Path
) -> None:
    last = [d["n"] - 1 for d in decisions if d["policy_source"] == "last_policy"]
    assert last
    for number in [*last, *range(0, 100, 10)]:
        for source in {"learner", "last_policy", "scoring", "override"} - {decisions[number]["policy_source"]}:
            difference = found(recording, tmp_path, number, ["policy_source"], lambda v, source=source: source)
            assert (difference.subject, difference.field) == ("decision", "policy_source")


@pytest.mark.parametrize("part", ["performance", "gaze"])
def test_raised_requirement_is_found_because_the_decision_is_not_stale(
    recording: Path, decisions: list[dict[str, Any]], tmp_path: Path, part: str
) -> None:
    fresh = [d["n"] - 1 for d in decisions if not d["stale"] and d["policy_source"] == "learner" and d["n"] > 1]
    for number in fresh[::20]:
        change = (lambda v: v + 1) if part == "performance" else (lambda v: {s: n + 1000 for s, n in v.items()})
        difference = found(recording, tmp_path, number, ["required", part], change)
        assert difference.subject == "decision"
        assert difference.field in ("policy_source", "stale")


def test_lowered_requirement_is_found_where_it_made_the_decision_stale(tmp_path: Path) -> None:
    session = Session(seed=3)
    session.deliver()
    session.gaze()
    session.deliver()
    session.answered = session.answered.model_copy(update={"gaze": {"tx300": 5}})
    session.decide(1, timed_out=True)
    recording = session.ended().finished(tmp_path)
    assert verify(recording).ok
    difference = found(recording, tmp_path, 0, ["required", "gaze", "tx300"], lambda v: 0)
    assert (difference.field, difference.recorded, difference.derived) == ("stale", True, False)


@pytest.mark.parametrize("part", ["decision", "performance", "config", "observation", "policy"])
def test_requirement_of_what_never_was_is_found(
    recording: Path, decisions: list[dict[str, Any]], tmp_path: Path, part: str
) -> None:
    number = next(d["n"] - 1 for d in decisions if d["stale"] and d["policy_source"] == "last_policy")
    difference = found(recording, tmp_path, number, ["required", part], lambda v: 10_000)
    assert (difference.subject, difference.recorded) == ("decision", 10_000)
    assert difference.field == f"required.{part}"


def test_decision_without_its_requirement_is_found(recording: Path, tmp_path: Path) -> None:
    difference = found(recording, tmp_path, 30, ["required"], lambda v: None)
    assert (difference.subject, difference.field) == ("decision", "required")


@pytest.mark.parametrize(("field", "value"), [("decision_id", "another"), ("task", None)])
def test_changed_command_of_a_decision_is_found(recording: Path, tmp_path: Path, field: str, value: Any) -> None:
    for number in (20, 57):
        change = (lambda v: value) if value else (lambda v: "a" if v == "b" else "b")
        difference = found(recording, tmp_path, number, [field], change)
        assert difference.subject in ("decision", "performance", "transition"), "what follows from the decision"


def test_changed_format_is_found(recording: Path, tmp_path: Path) -> None:
    difference = verify(rewritten(recording, tmp_path / "t", changed("session", 0, ["format"], lambda v: 2))).difference
    assert difference is not None
    assert (difference.subject, difference.field) == ("session", "format")


def test_metadata_names_the_format_from_3_on(recording: Path, tmp_path: Path) -> None:
    older = Session(recording_format=2).interactions(3).ended().finished(tmp_path)
    metadata = []
    for path in (recording, older):
        whole = Recording(path)
        list(whole.messages())
        metadata.append(whole.metadata["shift:session"].get("format"))
    assert metadata == [str(FORMAT), None]


@pytest.mark.parametrize("field", ["without_override", "probabilities"])
def test_changed_choice_of_shift_where_a_person_overrode_it_is_found(
    recording: Path, decisions: list[dict[str, Any]], tmp_path: Path, field: str
) -> None:
    number = next(d["n"] - 1 for d in decisions if d["policy_source"] == "override")
    difference = found(recording, tmp_path, number, [field], _other_choice if field == "without_override" else _rotated)
    assert difference.subject == "decision"
    assert difference.field.startswith(field)


def _other_choice(choice: dict[str, str]) -> dict[str, str]:
    return {**choice, "hesitation": "none" if choice["hesitation"] == "hesitation" else "hesitation"}


def _rotated(row: list[float]) -> list[float]:
    return [*row[1:], row[0] + 0.001]


def test_recording_with_a_minimum_propensity_verifies(tmp_path: Path) -> None:
    session = Session({"decider": {"minimum_propensity": 0.05}, "learner": {"name": "ucb1"}}, seed=11)
    path = session.interactions(30).ended().finished(tmp_path)
    assert verify(path).ok
    rows = [json.loads(m.data)["probabilities"] for m in Recording(path).messages({"decision"})]
    assert all(min(row) >= 0.05 for row in rows)


def test_dropped_estimate_of_an_unchanged_configuration_is_missed(tmp_path: Path) -> None:
    session = Session(seed=4)
    session.deliver()
    session.do("recorder", _reward_scale(2.0))
    session.deliver()
    session.decide(1, timed_out=True)
    recording = session.ended().finished(tmp_path)
    estimates = [json.loads(m.data) for m in Recording(recording).messages({"estimate"})]
    assert [(e["seen"]["config"], e["task"]) for e in estimates] == [(1, "a"), (1, "b"), (2, "a"), (2, "b")]
    for number in (2, 3):
        difference = verify(rewritten(recording, tmp_path / "t", without("estimate", number))).difference
        assert difference is not None
        assert difference.subject == "estimate"
        assert "missing" in difference.sentence


def test_renumbered_outputs_after_a_dropped_estimate_are_found(recording: Path, tmp_path: Path) -> None:
    for number in (0, 1, 7, 30):
        difference = verify(rewritten(recording, tmp_path / "t", _dropped_and_renumbered(number))).difference
        assert difference is not None
        assert (difference.subject, difference.recorded) == ("estimate", None)
        assert "missing" in difference.sentence


def _reward_scale(scale: float) -> Configure:
    """A change that changes no estimate."""
    return Configure(command_id="c", session="s1", patch={"reward": {"scale": scale}})


def _dropped_and_renumbered(number: int) -> Edit:
    """An edit that drops an estimate and closes the gap in the decider's sequence."""

    def edit(messages: list[RecordedMessage]) -> list[RecordedMessage]:
        place = [i for i, m in enumerate(messages) if m.topic == "estimate"][number]
        dropped = messages[place].sequence
        return [
            m._replace(sequence=m.sequence - 1) if m.topic in OWNERS["decider"] and m.sequence > dropped else m
            for i, m in enumerate(messages)
            if i != place
        ]

    return edit


def test_configurations_before_the_first_observation_verify(tmp_path: Path) -> None:
    for delivered in range(8):
        session = Session(seed=delivered)
        for n in range(1, 4):
            session.change(n)
            session.deliver(delivered % 3)
        session.deliver(delivered)
        session.change(4)
        session.deliver()
        session.decide(1, timed_out=False)
        report = verify(session.ended().finished(tmp_path / str(delivered)))
        assert (report.ok, report.complete) == (True, True), report.difference


@pytest.mark.parametrize(("recording_format", "kind"), [(1, DeciderSearch), (2, DeciderSearch), (3, DeciderFold)])
def test_format_of_the_session_chooses_how_it_is_verified(recording_format: int, kind: type[object]) -> None:
    session = Session(recording_format=recording_format)
    start = session.states["recorder"].fact
    assert start.format == recording_format
    assert isinstance(decider_verification(Inputs(start, False), []), kind)
