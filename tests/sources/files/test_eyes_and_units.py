# ruff: noqa: E501 (the headers of real files are long)
"""Pupil sizes, eye openness and positions of single eyes and in millimetres, in the tables of several makers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import GazeFile, read_gaze
from shift_sources.files.options import Millimetres, Options, Origin, ScreenSize, time_unit_of
from shift_sources.files.samples import Eyes, chunk_of

MM = "Recording timestamp [ms]\tGaze point X [DACS mm]\tGaze point Y [DACS mm]\n1\t101,8\t57.2\n"
STUDIO_MM = "RecordingTimestamp\tGazePointLeftX (ADCSmm)\tGazePointLeftY (ADCSmm)\tValidityLeft\tGazePointRightX (ADCSmm)\tGazePointRightY (ADCSmm)\tValidityRight\n1\t101.8\t57.2\t0\t305.4\t57.2\t0\n2\t101.8\t57.2\t0\t\t\t4\n"
SIZE = Millimetres(509, 286)
PRO_LAB = "Recording timestamp [μs]\tGaze point X [DACS px]\tGaze point Y [DACS px]\tPupil diameter left [mm]\tPupil diameter right [mm]\tEye openness left [mm]\tEye openness right [mm]\n1\t500\t250\t3,5\t\t9,5\t0\n"
STUDIO = (
    "RecordingTimestamp\tGazePointX (ADCSpx)\tGazePointY (ADCSpx)\tPupilLeft\tPupilRight\n1\t500\t250\t3,5\t-1,00\n"
)
TITTA = "device_time_stamp\tleft_gaze_point_on_display_area_x\tleft_gaze_point_on_display_area_y\tleft_gaze_point_valid\tright_gaze_point_on_display_area_x\tright_gaze_point_on_display_area_y\tright_gaze_point_valid\tleft_pupil_diameter\tleft_pupil_valid\tright_pupil_diameter\tright_pupil_valid\tleft_eye_openness_diameter\tleft_eye_openness_valid\n1\t0.5\t0.5\tTrue\tnan\tnan\tFalse\t3.5\tTrue\t4.0\tFalse\t9.5\tTrue\n"
GAZEPOINT = "TIME(x),BPOGX,BPOGY,BPOGV,LPD,LPV,RPD,RPV,LPMM,LPMMV,\n0.1,0.5,0.5,1,18.3,1,18.2,0,3.5,1,\n0.2,0.5,0.5,1,18.3,1,18.2,1,3.5,0,\n"


def read(folder: Path, text: str, **said: Any) -> GazeFile:
    path = folder / "gaze.tsv"
    path.write_text(text, encoding="utf-8")
    return read_gaze(path, Options(**{"screen": ScreenSize(1000, 500), **said}))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (PRO_LAB, [Eyes(3.5, None, 9.5, 0.0)]),
        (STUDIO, [Eyes(3.5)]),
        (TITTA, [Eyes(3.5, None, 9.5)]),
        (GAZEPOINT, [Eyes(3.5), Eyes(None, 18.2)]),
    ],
    ids=["pro-lab", "studio", "titta", "gazepoint"],
)
def test_eyes_are_read_beside_the_gaze(tmp_path: Path, text: str, expected: list[Eyes]) -> None:
    found = read(tmp_path, text)
    assert [s.eyes for s in found.samples] == expected
    assert found.samples[0].x == 0.5


def test_chunk_has_the_columns_of_the_eyes_that_the_file_has(tmp_path: Path) -> None:
    chunk = chunk_of(read(tmp_path, PRO_LAB).samples, "tobii", 0)
    assert (chunk.pupil_left, chunk.pupil_right) == ([3.5], None)
    assert (chunk.openness_left, chunk.openness_right) == ([9.5], [0.0])


def test_millimetres_need_the_size_of_the_stimulus(tmp_path: Path) -> None:
    found = read(tmp_path, MM, screen_mm=SIZE).samples[0]
    assert (found.x, found.y) == pytest.approx((0.2, 0.2))
    with pytest.raises(InvalidSettings, match="--screen-mm, such as 509x286"):
        read(tmp_path, MM)


def test_millimetres_are_used_where_only_they_can_be_converted(tmp_path: Path) -> None:
    both = MM.replace("\n1\t", "\tGaze point X [DACS px]\tGaze point Y [DACS px]\n1\t").replace(
        "57.2", "57.2\t999\t999"
    )
    assert read(tmp_path, both, screen=None, screen_mm=SIZE).samples[0].x == pytest.approx(0.2)
    assert read(tmp_path, both, screen_mm=SIZE).samples[0].x == pytest.approx(0.999)


def test_millimetres_of_studio_need_an_origin_too(tmp_path: Path) -> None:
    with pytest.raises(InvalidSettings, match="does not say where its positions begin: give --origin"):
        read(tmp_path, STUDIO_MM, screen_mm=SIZE)
    both, left = read(tmp_path, STUDIO_MM, screen_mm=SIZE, origin=Origin.BOTTOM_LEFT).samples
    assert (both.x, both.y) == pytest.approx((0.4, 0.8)), "the mean of both eyes"
    assert (left.x, left.y) == pytest.approx((0.2, 0.8))


def test_unknown_validity_is_reported(tmp_path: Path) -> None:
    text = STUDIO_MM.replace("\t57.2\t0\t305", "\t57.2\tgood\t305")
    with pytest.raises(MalformedMessage, match=r"gaze.tsv:2: ValidityLeft: 'good'"):
        read(tmp_path, text, screen_mm=SIZE, origin=Origin.TOP_LEFT)


@pytest.mark.parametrize(
    "text",
    [
        "Recording timestamp [ms]\tRecording name\tGaze point X [DACS px]\tGaze point Y [DACS px]\n5\tr1\t500\t250\n6\tr2\t100\t250\n7\tr2\t100\t250\n",
        "timestamp [ns],recording id,gaze x [px],gaze y [px]\n5,r1,500,250\n1,r2,100,250\n9,r2,100,250\n",
    ],
    ids=["tobii", "neon"],
)
def test_recordings_of_two_persons_are_never_one_gaze(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidSettings, match=r"holds several recordings, the second one from line 3: .*--recording"):
        read(tmp_path, text)
    assert [s.x for s in read(tmp_path, text, recording="r1").samples] == [0.5]
    assert [s.x for s in read(tmp_path, text, recording="r2").samples] == [0.1, 0.1]


def test_unit_of_a_time_without_one_can_be_given(tmp_path: Path) -> None:
    text = "Recording timestamp\tGaze point X\tGaze point Y\n0\t500\t250\n16\t500\t250\n"
    assert read(tmp_path, text).samples[1].t == pytest.approx(16e-6), "microseconds, as in current versions"
    assert read(tmp_path, text, time_unit="ms").samples[1].t == pytest.approx(0.016)
    said = text.replace("timestamp", "timestamp [s]")
    assert read(tmp_path, said, time_unit="ms").samples[1].t == 16.0, "the file says its unit"
    with pytest.raises(InvalidSettings, match="did you mean 'ms'"):
        time_unit_of("msec")


def test_titta_is_read_with_commas_too(tmp_path: Path) -> None:
    assert read(tmp_path, TITTA.replace("\t", ",")) == read(tmp_path, TITTA)
