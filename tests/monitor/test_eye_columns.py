"""Pupil size and openness of the eyes: recorded as they came, compared in repeats, and without effect on the model."""

from __future__ import annotations

import pytest
from pydantic import ValidationError
from shift_monitor.gaze_columns import gaze_chunk_of, recorded_columns
from shift_schemas.messages import Gaze, GazeChunk, Seen
from shift_schemas.timestamps import Stamp

EYES = {"pupil_left": [3.1, None, 3.3], "openness_right": [0.0, 9.5, None]}
POINTS = {"x": [0.1, None, 0.3], "y": [0.1, None, 0.3], "valid": [True, False, True]}


def chunk(**columns: object) -> GazeChunk:
    return GazeChunk.model_validate({"source": "tx", "seq": 0, "t": [0.0, 0.1, 0.2], **columns})


def fact(sent: GazeChunk) -> Gaze:
    return Gaze(
        session="s", stamp=Stamp.of(0), seen=Seen(), source=sent.source, seq=sent.seq, t=sent.t,
        **recorded_columns(sent),
    )  # fmt: skip


def test_lost_values_are_recorded_as_numbers() -> None:
    recorded = recorded_columns(chunk(**POINTS, **EYES))
    assert recorded["pupil_left"] == [3.1, 0.0, 3.3]
    assert recorded["openness_right"] == [0.0, 9.5, -1.0]
    assert not {"pupil_right", "openness_left"} & set(recorded)


@pytest.mark.parametrize("gaze", [POINTS, {"aoi": ["cup", None, "cup"]}])
def test_recorded_chunk_is_the_chunk_that_was_sent(gaze: dict[str, object]) -> None:
    sent = chunk(**gaze, **EYES)
    again = gaze_chunk_of(fact(sent))
    assert (again.pupil_left, again.openness_right, again.pupil_right) == (*EYES.values(), None)
    assert fact(again) == fact(sent)


@pytest.mark.parametrize(
    ("columns", "rule"),
    [
        ({"pupil_left": [3.0]}, "pupil_left has 1 entries and t has 3"),
        ({"openness_left": [-1.0, 0.0, 0.0]}, "greater than or equal to 0"),
        ({"pupil_right": [float("nan"), 0.0, 0.0]}, "finite number"),
    ],
)
def test_wrong_column_is_refused_with_its_rule(columns: dict[str, object], rule: str) -> None:
    with pytest.raises(ValidationError, match=rule):
        chunk(**POINTS, **columns)
