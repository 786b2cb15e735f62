"""Verify: no difference in what is whole, and the right one in what is not."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from shift_recording.checksum import checksum_path
from shift_recording.mcap.reader import RecordedMessage, Recording
from shift_schemas.errors import UnknownThing
from shift_study.patching import merge_patch, merge_patch_between
from shift_verify.verify import verify
from support.verify_sessions import Edit, Session, changed, rewritten, without

SCORING = {"learner": {"name": "scoring"}}


FORMATS = [2, 3]
"""The format before and the format since which the outputs record the order of the decider's inputs."""


@pytest.fixture(scope="module", params=FORMATS, ids=lambda n: f"format-{n}")
def recording(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """100 interactions with gaze, overrides, markers and changes of the configuration."""
    session = Session(recording_format=request.param).interactions(100).ended()
    return session.finished(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize(
    "study",
    [{}, {"learner": {"discount": 0.5}}, SCORING, {"awareness": {"window": 4}, "capacity": {"recovery": 0.15}},
     {"tasks": None}],
    ids=["q-learning", "discount", "scoring", "window", "any task"],
)  # fmt: skip
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("recording_format", FORMATS)
def test_a_hundred_interactions_are_derived_again(
    tmp_path: Path, study: dict[str, Any], seed: int, recording_format: int
) -> None:
    session = Session(study, seed, recording_format).interactions(100).ended()
    report = verify(session.finished(tmp_path))
    assert report.difference is None
    assert (report.ok, report.complete, report.checksum) == (True, True, "matches")
    recorded = [subject for subject, _, _ in session.recorded]
    assert report.checked == {subject: recorded.count(subject) for subject in report.checked}
    assert sum(report.checked.values()) == len(recorded)
    assert report.checked["decision"] == report.checked["performance"] == report.checked["transition"] == 100


def test_short_sessions_end_with_every_kind_of_last_message(tmp_path: Path) -> None:
    for seed in range(60):
        session = Session(seed=seed, steady=True).interactions(1 + seed % 3)
        for _ in range(seed % 5):
            session.gaze("spare")
        recording = session.ended().finished(tmp_path / str(seed))
        report = verify(recording)
        assert (report.ok, report.complete) == (True, True), (seed, report.difference)


def test_late_and_stale_decisions_and_every_source_are_among_them(recording: Path) -> None:
    decisions = [json.loads(m.data) for m in Recording(recording).messages({"decision"})]
    assert {"learner", "last_policy", "override"} <= {d["policy_source"] for d in decisions}
    assert {True, False} == {d["stale"] for d in decisions}


@pytest.mark.parametrize("count", [0, 3, 40])
def test_an_unfinished_recording_is_verified_as_far_as_it_goes(tmp_path: Path, count: int) -> None:
    session = Session(seed=5).interactions(count)
    session.record(len(session.recorded) // 2 + 2)
    report = verify(session.segment(tmp_path))
    assert report.difference is None
    assert (report.ok, report.complete, report.checksum) == (True, False, "missing")
    assert "not finished" in report.reason


def test_a_paused_recording_is_whole_and_incomplete(tmp_path: Path) -> None:
    session = Session(seed=6).interactions(20)
    session.record()
    report = verify(session.finished(tmp_path))
    assert (report.ok, report.complete, report.difference) == (True, False, None)
    assert "has not ended" in report.reason


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9])
def test_a_segment_cut_off_anywhere_is_a_prefix(tmp_path: Path, kept: float) -> None:
    whole = Session(seed=7).interactions(30).ended().segment(tmp_path)
    data = whole.read_bytes()
    whole.write_bytes(data[: int(len(data) * kept)])
    report = verify(whole)
    assert (report.ok, report.complete) == (True, False)


def test_a_later_segment_says_that_its_beginning_is_elsewhere(tmp_path: Path) -> None:
    session = Session(seed=8).interactions(10).ended()
    session.recorded = session.recorded[40:]
    report = verify(session.segment(tmp_path))
    assert (report.ok, report.complete) == (True, False)
    assert report.reason


def test_progress_ends_at_its_total(recording: Path) -> None:
    told: list[tuple[int, int]] = []
    verify(recording, lambda done, total: told.append((done, total)))
    assert told[-1][0] == told[-1][1] > 0


def test_no_file_is_unknown(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        verify(tmp_path / "s1.mcap")


# --- tampering, rewritten with valid checksums ---

FIELDS: list[tuple[str, int, list[str | int], Callable[[Any], Any]]] = [
    ("session", 0, ["seed"], lambda v: v + 1),
    ("session", 0, ["participant"], lambda v: "P02"),
    ("session", -1, ["ended", "sec"], lambda v: v + 1),
    ("config", 2, ["version"], lambda v: v + 1),
    ("decision", 50, ["probabilities", 0], lambda v: v + 1e-6),
    ("decision", 50, ["propensity"], lambda v: 0.123),
    ("decision", 50, ["seed"], lambda v: v + 1),
    ("decision", 50, ["n"], lambda v: v + 1),
    ("decision", 50, ["scores", "negation"], lambda v: v + 0.01),
    ("decision", 50, ["strategy", "negation"], lambda v: "negation" if v != "negation" else "affirmation"),
    ("decision", 50, ["explored"], lambda v: not v),
    ("decision", 50, ["versions", "policy"], lambda v: v - 1),
    ("decision", 50, ["seen", "policy"], lambda v: v - 1),
    ("decision", 50, ["seen", "observation"], lambda v: v + 1),
    ("decision", 50, ["cognitive_state"], lambda v: "uncertain" if v != "uncertain" else "unfocused"),
    ("decision", 0, ["policy_source"], lambda v: "scoring"),
    ("estimate", 5, ["scores", "hesitation"], lambda v: v + 0.01),
    ("estimate", 5, ["task"], lambda v: "a" if v != "a" else "b"),
    ("override", 2, ["seen", "policy"], lambda v: v - 1),
    ("performance", 50, ["reward"], lambda v: v + 0.01),
    ("performance", 50, ["comprehension", "success"], lambda v: not v),
    ("performance", 50, ["enabledness", "duration_s"], lambda v: v + 1),
    ("performance", 99, ["cumulative_reward"], lambda v: v + 1e-9),
    ("transition", 50, ["value"], lambda v: v + 1e-6),
    ("transition", 50, ["reward"], lambda v: -v - 1),
    ("policy", 100, ["states", "engaged_observer", "values", 3], lambda v: v + 1e-6),
    ("policy", 100, ["states", "engaged_observer", "visits", 3], lambda v: v + 1),
    ("policy", 100, ["epsilon"], lambda v: v / 2),
    ("policy", 100, ["for_n"], lambda v: v + 1),
    ("observation", 100, ["gaze", "weights", "left"], lambda v: v + 1e-6),
    ("observation", 100, ["capacity", "value"], lambda v: v / 2 + 0.01),
    ("observation", 100, ["version"], lambda v: v + 1),
    ("observation", 100, ["seen", "decision"], lambda v: v + 1),
    ("observation", -1, ["gaze", "fixations"], lambda v: v + 1),
    ("fixation", 20, ["duration_s"], lambda v: v + 0.001),
    ("fixation", 20, ["aoi"], lambda v: "left" if v != "left" else "right"),
]


@pytest.mark.parametrize(("subject", "number", "path", "change"), FIELDS, ids=lambda v: "" if callable(v) else str(v))
def test_a_changed_field_is_found_where_it_is(
    recording: Path, tmp_path: Path, subject: str, number: int, path: list[str | int], change: Callable[[Any], Any]
) -> None:
    report = verify(rewritten(recording, tmp_path / "t", changed(subject, number, path, change)))
    assert not report.ok
    assert report.checksum == "matches"
    assert report.difference is not None
    assert report.difference.subject == subject
    assert report.difference.sentence


def test_the_difference_says_field_and_both_values(recording: Path, tmp_path: Path) -> None:
    tampered = rewritten(recording, tmp_path / "t", changed("performance", 50, ["reward"], lambda v: 9.0))
    difference = verify(tampered).difference
    assert difference is not None
    original = list(Recording(recording).messages({"performance"}))[50]
    assert difference.field == "reward"
    assert difference.recorded == 9.0
    assert difference.derived == json.loads(original.data)["reward"]
    assert difference.sequence == original.sequence
    assert json.loads(json.dumps(difference.as_json()))["field"] == "reward"


PHRASES = {"sentences": {"affirmation": "take it.", "negation": "not that."},
           "templates": {"hesitation": {"hesitation": "um, {sentence}"}}}  # fmt: skip
"""Phrases without a sentence for negation_affirmation."""


@pytest.mark.parametrize("change", [lambda text: f"{text} ", lambda text: None, lambda text: "" if text else "hello"])
def test_a_changed_text_is_found(tmp_path: Path, change: Callable[[Any], Any]) -> None:
    recording = Session({"phrases": PHRASES}).interactions(40).ended().finished(tmp_path / "whole")
    assert verify(recording).difference is None
    texts = [json.loads(m.data).get("text") for m in Recording(recording).messages({"decision"})]
    assert set(texts) == {"Take it.", "Um, take it.", "Not that.", "Um, not that.", None}
    number = next(n for n, text in enumerate(texts) if text)
    difference = verify(rewritten(recording, tmp_path / "t", changed("decision", number, ["text"], change))).difference
    assert difference is not None
    assert (difference.subject, difference.field, difference.derived) == ("decision", "text", texts[number])


def test_a_text_in_a_study_without_phrases_is_found(recording: Path, tmp_path: Path) -> None:
    tampered = rewritten(recording, tmp_path / "t", changed("decision", 3, ["text"], lambda v: "take it."))
    difference = verify(tampered).difference
    assert difference is not None
    assert (difference.subject, difference.field, difference.derived) == ("decision", "text", None)


def test_a_changed_override_shows_in_the_decision_that_follows_it(recording: Path, tmp_path: Path) -> None:
    for path, value in ((["strategy", "negation"], "affirmation"), (["reason"], "no"), (["task"], "b")):
        edit = changed("override", 2, path, lambda v, value=value: value)
        difference = verify(rewritten(recording, tmp_path / "t", edit)).difference
        assert difference is not None
        assert difference.subject == "decision"


@pytest.mark.parametrize("path", [["x", 3], ["y", 2]], ids=str)
def test_changed_gaze_shows_in_what_follows_from_it(recording: Path, tmp_path: Path, path: list[str | int]) -> None:
    subjects = set()
    for number in range(5, 60, 5):
        edit = changed("gaze", number, path, lambda v: 1 - v)
        difference = verify(rewritten(recording, tmp_path / "t", edit)).difference
        subjects.add(difference.subject if difference else "")
    assert subjects <= {"", "fixation", "observation", "gaze"}
    assert subjects & {"fixation", "observation"}


@pytest.mark.parametrize("number", [0, 50, -1])
@pytest.mark.parametrize(
    "subject",
    ["session", "config", "marker", "gaze", "fixation", "observation", "estimate", "decision", "override",
     "performance", "transition", "policy"],
)  # fmt: skip
def test_a_dropped_message_is_missed(recording: Path, tmp_path: Path, subject: str, number: int) -> None:
    count = sum(m.topic == subject for m in Recording(recording).messages())
    number = min(number % count, count - 2)  # without its last session a recording is one that was not finished
    report = verify(rewritten(recording, tmp_path / "t", without(subject, number)))
    assert not report.ok
    assert report.difference is not None
    assert report.difference.subject == subject
    assert "missing" in report.difference.sentence


def test_a_dropped_and_renumbered_message_is_missed(recording: Path, tmp_path: Path) -> None:
    def edit(messages: list[RecordedMessage]) -> list[RecordedMessage]:
        place = [i for i, m in enumerate(messages) if m.topic == "fixation"][10]
        later = messages[place].sequence
        mine = ("gaze", "fixation", "observation")
        return [
            m._replace(sequence=m.sequence - 1) if m.topic in mine and m.sequence > later else m
            for i, m in enumerate(messages)
            if i != place
        ]

    difference = verify(rewritten(recording, tmp_path / "t", edit)).difference
    assert difference is not None
    assert (difference.subject, difference.recorded) == ("fixation", None)


def _swapped(subject: str, keep_sequence: bool) -> Edit:
    def edit(messages: list[RecordedMessage]) -> list[RecordedMessage]:
        a, b = [i for i, m in enumerate(messages) if m.topic == subject][20:22]
        one, other = messages[a], messages[b]
        if keep_sequence:
            one, other = one._replace(sequence=other.sequence), other._replace(sequence=one.sequence)
        messages[a], messages[b] = other, one
        return messages

    return edit


@pytest.mark.parametrize("subject", ["gaze", "fixation", "observation", "estimate", "decision", "performance",
                                     "transition", "policy", "override", "config"])  # fmt: skip
@pytest.mark.parametrize("keep_sequence", [True, False], ids=["contents", "places"])
def test_swapped_messages_are_found(recording: Path, tmp_path: Path, subject: str, keep_sequence: bool) -> None:
    if subject in ("override", "config"):
        recording = Session({}, 9).interactions(300).ended().finished(tmp_path)
    report = verify(rewritten(recording, tmp_path / "t", _swapped(subject, keep_sequence)))
    assert report.difference is not None
    if subject != "gaze":
        assert report.difference.subject == subject


def test_a_stamp_that_is_not_the_time_of_publication_is_found(recording: Path, tmp_path: Path) -> None:
    edit = changed("decision", 9, ["stamp", "nsec"], lambda v: (v + 1) % 10**9)
    difference = verify(rewritten(recording, tmp_path / "t", edit)).difference
    assert difference is not None
    assert (difference.subject, difference.field) == ("decision", "stamp")


def test_a_message_that_is_none_is_found(recording: Path, tmp_path: Path) -> None:
    edit = changed("transition", 9, ["reward"], lambda v: "much")
    difference = verify(rewritten(recording, tmp_path / "t", edit)).difference
    assert difference is not None
    assert difference.subject == "transition"


def test_a_changed_attachment_or_metadata_is_found(tmp_path: Path) -> None:
    session = Session(seed=4).interactions(5).ended()
    state = session.states["recorder"]
    attachments, metadata = session.attachments, session.metadata
    for name in ("scoring-table.json", "policy-last.json", "policy-first.json"):
        session.attachments = lambda name=name: [  # type: ignore[method-assign,misc]
            a if a.name != name else type(a)(a.name, a.media_type, b'{"a": 1}', a.log_time) for a in attachments()
        ]
        difference = verify(session.finished(tmp_path)).difference
        assert difference is not None
        assert (difference.subject, difference.field) == ("attachment", name)
        (tmp_path / "s1.mcap").unlink()
    session.attachments = attachments  # type: ignore[method-assign]
    changed_metadata = metadata()
    changed_metadata["shift:session"]["participant"] = "P99"
    session.metadata = lambda: changed_metadata  # type: ignore[method-assign]
    difference = verify(session.finished(tmp_path)).difference
    assert state.fact.participant == "P01"
    assert difference is not None
    assert (difference.subject, difference.field) == ("metadata", "shift:session.participant")


# --- single bits ---


def _flipped(source: Path, target: Path, bit: int) -> None:
    data = bytearray(source.read_bytes())
    data[bit // 8] ^= 1 << bit % 8
    target.write_bytes(data)


def test_a_flipped_bit_anywhere_makes_it_fail(recording: Path, tmp_path: Path) -> None:
    rng, target = random.Random(3), tmp_path / recording.name
    shutil.copy(checksum_path(recording), checksum_path(target))
    for _ in range(200):
        _flipped(recording, target, rng.randrange(8 * recording.stat().st_size))
        report = verify(target)
        assert (report.ok, report.checksum) == (False, "differs")
        assert report.difference is not None
        assert report.difference.subject == "checksum"


def test_without_a_checksum_file_a_flipped_bit_in_a_message_makes_it_fail(tmp_path: Path) -> None:
    recording = Session(seed=2).interactions(8).ended().finished(tmp_path)
    chunks = [(m.chunk, m.message) for m in Recording(recording).located()]
    begin, size = chunks[0][0], recording.stat().st_size
    content = _chunk_end(recording, begin)
    rng, target = random.Random(4), tmp_path / "flipped.mcap"
    assert content < size
    for _ in range(200):
        _flipped(recording, target, rng.randrange(8 * begin, 8 * content))
        assert not verify(target).ok


def _chunk_end(recording: Path, begin: int) -> int:
    data = recording.read_bytes()
    return begin + 9 + int.from_bytes(data[begin + 1 : begin + 9], "little")


def test_a_finished_recording_that_is_cut_off_is_damaged(recording: Path, tmp_path: Path) -> None:
    target = tmp_path / "s1.mcap"
    data = recording.read_bytes()
    for kept in (0.3, 0.7, 0.999):
        target.write_bytes(data[: int(len(data) * kept)])
        report = verify(target)
        assert not report.ok
        assert report.difference is not None
        assert report.difference.subject == "file"


def test_the_patch_between_two_studies_makes_one_of_the_other() -> None:
    before = {"a": 1, "b": {"c": 2, "d": [1]}, "e": 5}
    after = {"a": 1, "b": {"c": 3, "d": [1, 2]}, "f": {"g": 1}}
    patch = merge_patch_between(before, after)
    assert merge_patch(before, patch) == after
    assert "a" not in patch
