"""Streams of known programs become samples; a unit is never guessed. The streams are those of SOURCES in the wild."""

from __future__ import annotations

from math import nan
from typing import Any

import pytest
from shift_schemas.errors import InvalidSettings
from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Eyes
from shift_sources.live.lsl_streams import Channel, Stream, mapping_of

SCREEN = ScreenSize(1600, 1200)


def stream(*channels: Channel, name: str = "Eyes", kind: str = "Gaze") -> Stream:
    return Stream(name, kind, 200.0, False, channels)


CONVENTION = stream(
    Channel("left_gaze_x", "ScreenX", "left", "normalized"), Channel("left_gaze_y", "ScreenY", "left", "normalized"),
    Channel("right_gaze_x", "ScreenX", "right", "normalized"),
    Channel("right_gaze_y", "ScreenY", "right", "normalized"),
    Channel("pupil_left", "Diameter", "left", "mm"), Channel("pupil_right", "Diameter", "right", "mm"),
    Channel("confidence", "Confidence"),
)  # fmt: skip
PUPIL_CAPTURE = stream(
    Channel("confidence", "Confidence", "both", "normalized"), Channel("norm_pos_x", "ScreenX", "both", "normalized"),
    Channel("norm_pos_y", "ScreenY", "both", "normalized"), Channel("gaze_point_3d_x", "PositionX", "both", "mm"),
    Channel("diameter0_2d", "Diameter", "right", "pixels"), Channel("diameter1_3d", "Diameter", "left", "mm"),
)  # fmt: skip
TITTA = stream(
    Channel("x.position_on_display_area.gaze_point.left_eye"),
    Channel("y.position_on_display_area.gaze_point.left_eye"),
    Channel("valid.gaze_point.left_eye"), Channel("available.gaze_point.left_eye"),
    Channel("diameter.pupil.left_eye"), Channel("valid.pupil.left_eye"),
    Channel("x.position_on_display_area.gaze_point.right_eye"),
    Channel("y.position_on_display_area.gaze_point.right_eye"),
    Channel("valid.gaze_point.right_eye"), Channel("diameter.eye_openness.right_eye"),
)  # fmt: skip
NEON = stream(Channel("x", "ScreenX", "both", "pixels"), Channel("y", "ScreenY", "both", "pixels"))
TOBII = stream(
    *(Channel(label, "", "", "screencoords") for label in ("left_x", "left_y")), Channel("left_pupil", "", "", "mm"),
    *(Channel(label, "", "", "screencoords") for label in ("right_x", "right_y")), Channel("right_pupil", "", "", "mm"),
)  # fmt: skip
EYELINK = stream(
    *map(Channel, ("leftEyeX", "leftEyeY", "rightEyeX", "rightEyeY", "leftPupilArea", "rightPupilArea",
                   "pixelsPerDegreeX", "pixelsPerDegreeY", "eyelinktimestamp", "LSLtimestamp")),
    name="EyeLink",
)  # fmt: skip


@pytest.mark.parametrize(
    ("found", "values", "point", "eyes"),
    [
        (CONVENTION, [0.2, 0.4, 0.4, 0.8, 3.0, 3.5, 0.9], (0.3, 0.6), Eyes(3.0, 3.5)),
        (CONVENTION, [0.2, 0.4, nan, nan, 3.0, nan, 0.9], (0.2, 0.4), Eyes(3.0, None)),
        (CONVENTION, [0.2, 0.4, 0.4, 0.8, 0.0, 3.5, 0.5], None, Eyes(None, 3.5)),
        (PUPIL_CAPTURE, [0.8, 0.25, 0.75, 12.0, 40.0, 3.1], (0.25, 0.25), Eyes(3.1, 40.0)),
        (PUPIL_CAPTURE, [0.5, 0.25, 0.75, 12.0, 40.0, 3.1], None, Eyes(3.1, 40.0)),
        (TITTA, [0.2, 0.4, 1, 1, 3.0, 1, 0.9, 0.9, 0, 8.5], (0.2, 0.4), Eyes(3.0, None, None, 8.5)),
        (TITTA, [0.2, 0.4, 0, 1, 3.0, 1, 0.9, 0.9, 0, 8.5], None, Eyes(3.0, None, None, 8.5)),
        (NEON, [800.0, 300.0], (0.5, 0.25), Eyes()),
        (NEON, [nan, 300.0], None, Eyes()),
        (TOBII, [0.2, 0.4, 3.0, 0.4, 0.8, 3.5], (0.3, 0.6), Eyes(3.0, 3.5)),
        (EYELINK, [400.0, 300.0, -32768.0, -32768.0, 900.0, 0.0, 30.0, 30.0, 1.0, 1.0], (0.25, 0.25), Eyes(900.0)),
        (EYELINK, [-32768.0] * 6 + [30.0, 30.0, 1.0, 1.0], None, Eyes()),
    ],
    ids=lambda value: value.channels[0].label if isinstance(value, Stream) else "",
)  # fmt: skip
def test_values_of_known_programs(found: Stream, values: list[float], point: Any, eyes: Eyes) -> None:
    sample = mapping_of(found, SCREEN).sample(1.5, values)
    assert sample.valid == (point is not None)
    assert (sample.x, sample.y) == (pytest.approx(point) if point else (None, None))
    assert (sample.t, sample.eyes) == (1.5, eyes)


def test_pixels_need_the_size_of_the_screen() -> None:
    with pytest.raises(InvalidSettings, match="is in pixels: give the size of the screen"):
        mapping_of(NEON)


def test_unit_that_the_stream_does_not_say_is_asked_for() -> None:
    silent = stream(Channel("gaze_x", "ScreenX"), Channel("gaze_y", "ScreenY"))
    with pytest.raises(InvalidSettings, match=r"does not say the unit of 'gaze_x' .*--unit normalised or"):
        mapping_of(silent)
    assert mapping_of(silent, unit="normalised").sample(0.0, [0.5, 0.25])[1:3] == (0.5, 0.25)
    assert mapping_of(silent, SCREEN, unit="pixels", origin="bottom-left").sample(0.0, [800.0, 300.0])[1:3] == (
        0.5,
        0.75,
    )


def test_stream_without_points_names_its_channels() -> None:
    with pytest.raises(InvalidSettings, match="its channels: Fp1, Fp2"):
        mapping_of(stream(Channel("Fp1", "EEG"), Channel("Fp2", "EEG")))


def test_objects_are_names_or_numbers() -> None:
    mapping = mapping_of(stream(Channel("object", "ObjectId")))
    assert [mapping.object([value]) for value in (2.0, 2.5, nan, " cup ")] == ["2", "2.5", "", "cup"]


@pytest.mark.parametrize(
    ("found", "gaze", "markers"),
    [
        (NEON, True, False), (stream(name="EyeLink", kind="EyeTracking"), True, False),
        (stream(Channel("Fp1", "EEG"), kind="EEG"), False, False),
        (Stream("Events", "Markers", 0.0, True), False, True), (Stream("Neon Events", "Event", 0.0, True), False, True),
    ],
)  # fmt: skip
def test_kinds_of_streams(found: Stream, gaze: bool, markers: bool) -> None:
    assert (found.has_gaze, found.has_markers) == (gaze, markers)
    assert found.name in found.line
