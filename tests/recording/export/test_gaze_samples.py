"""Gaze read as columns has the rows that a program reads which goes from sample to sample."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_recording.export.arrow_tables import gaze_reader
from shift_recording.export.columns import Names
from shift_recording.export.tables import table_columns
from shift_recording.mcap.reader import RecordedMessage
from shift_schemas.codec import encode
from shift_schemas.messages import Gaze, Session
from shift_schemas.messages.monitor import EYE_COLUMNS
from shift_schemas.timestamps import Stamp

READER = gaze_reader(table_columns(Names())["gaze"], as_text=False)
STARTED = Stamp(sec=1_790_000_000, nsec=5)
NUMBERS = st.floats(0, 1, allow_nan=False)


@st.composite
def chunks(draw: st.DrawFn) -> Gaze:
    count = draw(st.integers(1, 5))
    t = sorted(draw(st.lists(st.floats(0, 1e6, allow_nan=False), min_size=count, max_size=count, unique=True)))
    same: dict[str, Any] = {
        "session": "s1", "stamp": Stamp(sec=draw(st.integers(0, 2**32)), nsec=draw(st.integers(0, 10**9 - 1))),
        "source": draw(st.sampled_from(["tx", "ros"])), "seq": draw(st.integers(0, 9)), "t": t,
        "segment": draw(st.integers(0, 3)), "outcome": draw(st.sampled_from(["applied", "late"])),
    }  # fmt: skip
    lost = {"pupil_left": 0.0, "pupil_right": 0.0, "openness_left": -1.0, "openness_right": -1.0}
    for name in draw(st.sets(st.sampled_from(sorted(lost)))):
        values = st.one_of(st.just(lost[name]), st.floats(0, 10, allow_subnormal=False))
        same[name] = draw(st.lists(values, min_size=count, max_size=count))
    if draw(st.booleans()):
        names = st.sampled_from(["", "robot", "cup"])
        return Gaze(**same, aoi=draw(st.lists(names, min_size=count, max_size=count)))
    valid = draw(st.lists(st.booleans(), min_size=count, max_size=count))
    points = [[draw(NUMBERS) if ok else 0.0 for ok in valid] for _ in range(2)]
    return Gaze(**same, x=points[0], y=points[1], valid=valid)


def session() -> Session:
    return Session.model_construct(session="s1", participant="P01", condition=None, started=STARTED)


def naive(facts: list[Gaze]) -> list[dict[str, Any]]:
    """Return the rows, made from sample to sample."""
    rows = []
    for fact in facts:
        for i, t in enumerate(fact.t):
            points = not fact.aoi
            seen = points and fact.valid[i]
            session_s = (fact.stamp.ns - STARTED.ns) / 1e9 - (fact.t[-1] - t)
            rows.append({
                "session": "s1", "participant": "P01", "condition": None, "source": fact.source,
                "segment": fact.segment, "seq": fact.seq, "sample": i, "outcome": fact.outcome,
                "stamp_utc": fact.stamp.ns, "session_s": session_s, "t_s": t,
                "x": fact.x[i] if seen else None, "y": fact.y[i] if seen else None,
                "valid": fact.valid[i] if points else None, "aoi": None if points else fact.aoi[i],
                "hit": None, **{name: of_eye(fact, name, i) for name in EYE_COLUMNS},
            })  # fmt: skip
    return rows


def of_eye(fact: Gaze, name: str, i: int) -> float | None:
    column = getattr(fact, name)
    if column is None or column[i] < 0 or (column[i] == 0 and name.startswith("pupil")):
        return None
    return float(column[i])


def messages(*payloads: bytes) -> list[RecordedMessage]:
    return [RecordedMessage("gaze", number, 0, 0, payload) for number, payload in enumerate(payloads, 1)]


def rows_of(found: Any) -> list[dict[str, Any]]:
    times = found["stamp_utc"].cast("int64").to_pylist()
    return [row | {"stamp_utc": ns} for row, ns in zip(found.drop(["stamp_utc"]).to_pylist(), times, strict=True)]


@given(facts=st.lists(chunks(), max_size=6))
def test_rows_are_those_of_the_naive_program(facts: list[Gaze]) -> None:
    samples = READER.read(session(), messages(*map(encode, facts)))
    assert samples.damage is None
    assert rows_of(samples.rows) == naive(facts)


@given(facts=st.lists(chunks(), min_size=1, max_size=4))
def test_json_of_other_programs_is_read_as_well(facts: list[Gaze]) -> None:
    indented = [json.dumps(json.loads(encode(fact)), indent=1).encode() for fact in facts]
    assert rows_of(READER.read(session(), messages(*indented)).rows) == naive(facts)


def test_fields_that_an_old_format_leaves_out_have_their_defaults() -> None:
    fact = Gaze(session="s1", stamp=STARTED, source="tx", seq=0, t=[0.0], x=[0.1], y=[0.2], valid=[True])
    old = {k: v for k, v in json.loads(encode(fact)).items() if k not in ("segment", "outcome", "aoi", "warnings")}
    assert rows_of(READER.read(session(), messages(json.dumps(old).encode())).rows) == naive([fact])


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"t": ["soon"]}, "t"),
        ({"x": [0.1, 0.2]}, "t has 1 entries"),
        ({"stamp": None}, "stamp"),
        ({"aoi": ["cup"]}, "t has 1 entries"),
        ({"t": [], "x": [], "y": [], "valid": []}, "t has 0 entries"),
        ({"x": [None]}, "x"),
        ({"pupil_left": [3.0, 3.1]}, "pupil_left has 2"),
    ],
)
def test_nothing_is_read_behind_a_message_that_is_not_valid(change: dict[str, Any], named: str) -> None:
    fact = Gaze(session="s1", stamp=STARTED, source="tx", seq=0, t=[0.0], x=[0.1], y=[0.2], valid=[True])
    wrong = json.dumps(json.loads(encode(fact)) | change).encode()
    samples = READER.read(session(), messages(encode(fact), wrong, encode(fact)))
    assert rows_of(samples.rows) == naive([fact])
    assert samples.damage is not None
    assert "gaze 2" in samples.damage.detail
    assert named in samples.damage.detail
