# ruff: noqa: E501 (the headers of real files are long)
"""Gaze files that name AOIs: Tobii, Gazepoint, surfaces of Pupil Labs and fixations of Pupil Cloud."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import GazeFile, read_gaze
from shift_sources.files.options import Options, ScreenSize, aoi_map_of

PRO_LAB = """Recording timestamp [ms]\tSensor\tParticipant name\tEvent\tGaze point X [DACS px]\tGaze point Y [DACS px]\tValidity left\tValidity right\tAOI hit [Desk - cup]\tAOI hit [Desk - Right hand]
1\tMouse\tAda\t\t\t\t\t\t\t
2\tEye Tracker\tAda\t\t500\t250\tValid\tInvalid\t1\t1
2\t\tAda\tKeyboard\t\t\t\t\t\t
4\tEye Tracker\tAda\t\t500\t250\tValid\tValid\t0\t0
6\tEye Tracker\tAda\t\t\t\tInvalid\tInvalid\t0\t0
8\tEye Tracker\tAda\t\t500\t250\tValid\tValid\t\t1
"""
GLASSES = """Recording timestamp\tSensor\tParticipant name\tEye movement type\tAOI hit [a - b - robot]\tAOI hit [a - b - cup]
1000000\tGyroscope\tAda\tFixation\t1\t0
1005000\tEye Tracker\tAda\tFixation\t0\t1
1010000\tEye Tracker\tAda\tEyesNotFound\t0\t0
"""
STUDIO = """ParticipantName\tRecordingTimestamp\tAOI[robot]Hit\tAOI[cup]Hit
Ada\t5\t-1\t1
Ada\t22\t0\t0
"""
GAZEPOINT = """MEDIA_ID,TIME(2021/07/13 09:21:09.801),FPOGX,FPOGY,FPOGV,AOI,
0,0.5,0.1,0.1,1,Right-AOI 4,
0,0.6,0.1,0.1,1,,
0,0.7,0.1,0.1,0,Right-AOI 4,
"""
PUPIL_SURFACE = """world_timestamp,world_index,gaze_timestamp,x_norm,y_norm,x_scaled,y_scaled,on_surf,confidence
9.9,0,10.0,0.5,0.25,1,1,True,0.99
9.9,0,10.01,1.5,0.25,1,1,False,0.99
9.9,0,10.02,0.5,0.25,1,1,True,0.1
"""
NEON_SURFACE = """section id,recording id,timestamp [ns],gaze detected on surface,gaze position on surface x [normalized],gaze position on surface y [normalized],fixation id,blink id
a,b,1700000000000000000,True,0.1,0.2,,
a,b,1700000000005000000,False,,,,
a,b,1700000000010000000,True,0.1,0.2,,7
"""
FIXATIONS = """section id,recording id,fixation id,start timestamp [ns],end timestamp [ns],duration [ms]
s,r1,1,1700000000000000000,1700000000250000000,250
s,r1,2,1700000000250000000,1700000000350000000,100
s,r1,3,1700000000500000000,1700000000600000000,100
"""
AOI_FIXATIONS = """label id,aoi label,section id,recording id,fixation id,fixation duration [ms]
x,cup,s,r1,1,250
y,robot,s,r1,1,250
y,robot,s,r1,3,100
"""


def read(folder: Path, text: str, name: str = "gaze.csv", **said: Any) -> GazeFile:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_gaze(path, Options(**said))


def names(found: GazeFile) -> list[tuple[str | None, bool]]:
    assert found.named
    assert all(s.x is None and s.y is None for s in found.samples)
    return [(s.aoi, s.valid) for s in found.samples]


def test_pro_lab_hits_are_names_where_they_are_asked_for(tmp_path: Path) -> None:
    found = read(tmp_path, PRO_LAB, named=True, aoi_map={"Right hand": "hand"})
    assert names(found) == [("cup", True), (None, True), (None, False), ("hand", True)]
    assert [s.t for s in found.samples] == pytest.approx([0, 0.002, 0.004, 0.006])


def test_points_are_taken_where_a_file_has_both(tmp_path: Path) -> None:
    found = read(tmp_path, PRO_LAB, screen=ScreenSize(1000, 500))
    assert not found.named
    assert [(s.x, s.y) for s in found.samples] == [(0.5, 0.5), (0.5, 0.5), (None, None), (0.5, 0.5)]


def test_names_are_taken_where_a_file_has_no_points(tmp_path: Path) -> None:
    assert names(read(tmp_path, GLASSES)) == [("cup", True), (None, False)]
    assert names(read(tmp_path, STUDIO)) == [("cup", True), (None, True)]


def test_name_that_is_no_id_is_reported_and_can_be_mapped(tmp_path: Path) -> None:
    with pytest.raises(MalformedMessage) as refused:
        read(tmp_path, PRO_LAB, named=True)
    assert refused.value.detail.startswith("gaze.csv:7: AOI hit [Desk - Right hand]: 'Right hand' is not valid")
    assert "--aoi-map 'Right hand=NAME'" in refused.value.detail
    mapped = aoi_map_of(["Desk - Right hand=hand", "cup="])
    assert names(read(tmp_path, PRO_LAB, named=True, aoi_map=mapped))[0] == ("hand", True), "cup is no AOI of the study"


def test_gazepoint_names_its_aois(tmp_path: Path) -> None:
    found = read(tmp_path, GAZEPOINT, named=True, aoi_map={"Right-AOI 4": "robot"})
    assert names(found) == [("robot", True), (None, True), (None, False)]
    only_names = GAZEPOINT.replace("FPOG", "OTHER")
    assert names(read(tmp_path, only_names, aoi_map={"Right-AOI 4": "robot"}))[0] == ("robot", True)


def test_surface_is_an_aoi_of_its_file_s_name(tmp_path: Path) -> None:
    found = read(tmp_path, PUPIL_SURFACE, "gaze_positions_on_surface_cup.csv", named=True)
    assert names(found) == [("cup", True), (None, True), (None, False)]
    found = read(tmp_path, NEON_SURFACE, "gaze_on_surface_my desk.csv", named=True, aoi_map={"my desk": "desk"})
    assert names(found) == [("desk", True), (None, True), (None, False)]


def test_surface_without_a_name_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(MalformedMessage, match=r"gaze.csv:2: name of the file: .*--aoi-map 'gaze=NAME'"):
        read(tmp_path, NEON_SURFACE, named=True)
    assert names(read(tmp_path, NEON_SURFACE, named=True, aoi_map={"gaze": "desk"}))[0] == ("desk", True)


def test_fixations_of_pupil_cloud_are_names_over_their_time(tmp_path: Path) -> None:
    (tmp_path / "fixations.csv").write_text(FIXATIONS)
    found = read(tmp_path, AOI_FIXATIONS, "aoi_fixations.csv")
    assert [(round(s.t, 6), s.aoi) for s in found.samples] == [
        (0.0, "cup"), (0.1, "cup"), (0.2, "cup"), (0.25, None), (0.35, None), (0.5, "robot"), (0.6, None),
    ]  # fmt: skip
    older = AOI_FIXATIONS.replace("aoi label", "aoi name")
    assert read(tmp_path, older, "aoi_fixations.csv") == found


def test_recording_of_several_is_asked_for(tmp_path: Path) -> None:
    other = "s,r2,1,1700000001000000000,1700000001250000000,250\n"
    (tmp_path / "fixations.csv").write_text(FIXATIONS + other)
    with pytest.raises(InvalidSettings, match=r"fixations.csv holds several recordings, the second one from line 5"):
        read(tmp_path, AOI_FIXATIONS, "aoi_fixations.csv")
    assert read(tmp_path, AOI_FIXATIONS, "aoi_fixations.csv", recording="r2").samples[0].aoi is None


def test_fixations_beside_the_aois_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InvalidSettings, match=r"needs fixations.csv of the same folder"):
        read(tmp_path, AOI_FIXATIONS, "aoi_fixations.csv")
    (tmp_path / "fixations.csv").write_text(FIXATIONS.replace("1700000000600000000", "soon"))
    with pytest.raises(MalformedMessage, match=r"fixations.csv:4: end timestamp \[ns\]: 'soon'"):
        read(tmp_path, AOI_FIXATIONS, "aoi_fixations.csv")


def test_names_of_a_file_without_any_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidSettings, match="has no AOI names; leave --aoi out"):
        read(tmp_path, GAZEPOINT.replace("AOI", "OTHER"), named=True)


@pytest.mark.parametrize("text", ["cup", "=cup", "AOI 1=my cup"])
def test_map_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InvalidSettings, match="--aoi-map"):
        aoi_map_of([text])


@given(st.lists(st.lists(st.booleans(), min_size=3, max_size=3), min_size=1, max_size=20))
def test_written_hits_are_read_back(hits: list[list[bool]]) -> None:
    head = "\t".join(["Recording timestamp [ms]", *(f"AOI hit [Scene - a{i}]" for i in range(3))])
    rows = ["\t".join([str(10 * i), *(str(int(hit)) for hit in row)]) for i, row in enumerate(hits)]
    with TemporaryDirectory() as folder:
        found = read(Path(folder), "\n".join([head, *rows]) + "\n")
    assert [s.aoi for s in found.samples] == [f"a{row.index(True)}" if any(row) else None for row in hits]


@given(
    st.lists(
        st.tuples(st.integers(0, 9), st.integers(1, 20), st.sampled_from(["", "cup", "robot"])), min_size=1, max_size=10
    )
)
def test_written_fixations_are_read_back(fixations: list[tuple[int, int, str]]) -> None:
    """Each fixation has a pause before it and a duration, in units of 30 ms, and its AOI."""
    expected, rows, aois, time = {}, [], [], 0
    for i, (pause, duration, aoi) in enumerate(fixations):
        start, time = time + pause, time + pause + duration
        rows.append(f"s,r,{i},{start * 30_000_000},{time * 30_000_000},0")
        aois += [f"x,{aoi},s,r,{i},0"] if aoi else []
        expected |= dict.fromkeys(range(start, time), aoi or None)
    with TemporaryDirectory() as folder:
        (Path(folder) / "fixations.csv").write_text("\n".join([FIXATIONS.splitlines()[0], *rows]) + "\n")
        found = read(
            Path(folder), "\n".join([AOI_FIXATIONS.splitlines()[0], *aois]) + "\n", "aoi_fixations.csv"
        ).samples
    first = min(expected)
    for tick, aoi in expected.items():
        middle = (tick - first + 0.5) * 0.03
        assert [s.aoi for s in found if s.t <= middle][-1] == aoi
    assert found[-1].aoi is None
    assert all(b.t - a.t < 0.3 for a, b in pairwise(found) if a.aoi)
