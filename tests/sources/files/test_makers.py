# ruff: noqa: E501 (the headers of real files are long)
"""Gaze files of several makers: units, origins, marks of loss and decimal commas, and what is written is read back."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import ABOUT, FORMATS, read_samples
from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Sample

SCREEN = ScreenSize(2000, 1000)


def read(folder: Path, text: str, encoding: str = "utf-8", **given: Any) -> list[Sample]:
    path = folder / "gaze.csv"
    path.write_text(text, encoding=encoding)
    return list(read_samples(path, **given))


def near(t: float, x: float | None, y: float | None) -> Sample:
    return Sample(pytest.approx(t), x and pytest.approx(x), y and pytest.approx(y), x is not None)


LOST = None, None

PUPIL = """gaze_timestamp,world_index,confidence,norm_pos_x,norm_pos_y,base_data
5000.5,0,1.0,0.25,0.75,"1-2 3-4"
5000.504,0,0.2,0.3,0.7,1
5000.504,0,0.9,0.4,0.7,1
5000.512,1,0.6,1.2,-0.5,1
"""
PUPIL_SURFACE = """world_timestamp,world_index,gaze_timestamp,x_norm,y_norm,x_scaled,y_scaled,on_surf,confidence
9.9,0,10.0,0.5,0.25,1,1,True,0.99
9.9,0,10.01,1.5,0.25,1,1,False,0.99
"""
NEON = """section id,recording id,timestamp [ns],gaze x [px],gaze y [px],worn,fixation id,blink id,azimuth [deg],elevation [deg]
a,b,1700000000000000000,500.0,250.0,1,1,,0,0
a,b,1700000000005000000,500.0,250.0,0,1,,0,0
a,b,1700000000010000000,500.0,250.0,1,,3,0,0
"""
NEON_SURFACE = """section id,recording id,timestamp [ns],gaze detected on surface,gaze position on surface x [normalized],gaze position on surface y [normalized],fixation id
a,b,1700000000000000000,True,0.1,0.2,
a,b,1700000000005000000,False,,,
"""
GAZEPOINT = """MEDIA_ID,MEDIA_NAME,CNT,TIME(2024/05/01 10:00:00.123),FPOGX,FPOGY,FPOGV,BPOGX,BPOGY,BPOGV,USER
0,New,1,0.0,0.9,0.9,1,0.3,0.4,1,
0,New,2,0.0167,0.9,0.9,1,0.0,0.0,0,
"""
PRO_LAB = """Recording timestamp [μs]\tSensor\tParticipant name\tEvent\tGaze point X [DACS px]\tGaze point Y [DACS px]\tValidity left\tValidity right
1000\tMouse\tAda Lovelace\t\t\t\t\t
2000\tEye Tracker\tAda Lovelace\t\t500,5\t250\tValid\tInvalid
2500\t\tAda Lovelace\tRecordingStart\t\t\t\t
10333\tEye Tracker\tAda Lovelace\t\t\t\tInvalid\tInvalid
"""
STUDIO = "ParticipantName\tRecordingTimestamp\tGazePointX (ADCSpx)\tGazePointY (ADCSpx)\tValidityLeft\tValidityRight\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (PUPIL, [near(0, 0.25, 0.25), near(0.004, *LOST), near(0.012, 1.2, 1.5)]),
        (PUPIL_SURFACE, [near(0, 0.5, 0.75), near(0.01, *LOST)]),
        (NEON, [near(0, 0.25, 0.25), near(0.005, *LOST), near(0.01, *LOST)]),
        (NEON_SURFACE, [near(0, 0.1, 0.2), near(0.005, *LOST)]),
        (GAZEPOINT, [near(0, 0.3, 0.4), near(0.0167, *LOST)]),
        (PRO_LAB, [near(0, 0.25025, 0.25), near(0.008333, *LOST)]),
        (STUDIO + "x\t5\t200\t100\t0\t4\nx\t22\t200\t100\t4\t4\n", [near(0, 0.1, 0.1), near(0.017, *LOST)]),
    ],
    ids=["pupil", "pupil-surface", "neon", "neon-surface", "gazepoint", "pro-lab", "studio"],
)
def test_file_is_recognised_and_converted(tmp_path: Path, text: str, expected: list[Sample]) -> None:
    assert read(tmp_path, text, screen=SCREEN) == expected


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_pro_lab_is_read_in_every_encoding(tmp_path: Path, encoding: str) -> None:
    assert read(tmp_path, PRO_LAB, encoding, screen=SCREEN) == read(tmp_path, PRO_LAB, screen=SCREEN)


@pytest.mark.parametrize(("unit", "ticks"), [("μs", 1e6), ("ms", 1e3), ("s", 1.0)])
def test_unit_of_the_time_stands_in_the_header(tmp_path: Path, unit: str, ticks: float) -> None:
    head = f"Recording timestamp [{unit}]\tGaze point X [MCS norm]\tGaze point Y [MCS norm]\tGaze point X [DACS px]\n"
    found = read(tmp_path, head + f"{3 * ticks}\t0.1\t0.2\t99\n{4 * ticks}\t0.3\t0.4\t99\n")
    assert found == [near(0, 0.1, 0.2), near(1, 0.3, 0.4)], "normalised positions need no screen"


@pytest.mark.parametrize("text", [NEON, PRO_LAB], ids=["neon", "pro-lab"])
def test_size_of_the_screen_is_asked_for(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidSettings, match="--screen 1920x1080"):
        read(tmp_path, text)


def test_positions_in_millimetres_are_refused(tmp_path: Path) -> None:
    head = "Recording timestamp [ms]\tGaze point X [DACS mm]\tGaze point Y [DACS mm]\n"
    with pytest.raises(InvalidSettings, match="in mm: export the gaze point in pixels or normalised"):
        read(tmp_path, head + "1\t2\t3\n", screen=SCREEN)


def test_format_can_be_insisted_on(tmp_path: Path) -> None:
    assert read(tmp_path, PUPIL, format_="pupil")
    with pytest.raises(MalformedMessage, match="the header of one of these tables: neon"):
        read(tmp_path, PUPIL, format_="neon")
    with pytest.raises(InvalidSettings, match="did you mean 'pupil'"):
        read(tmp_path, PUPIL, format_="pupl")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PUPIL.replace("0.9,0.4", "1.9,0.4"), "gaze.csv:2: "), (PUPIL.replace("0.25,0.75", "left,0.75"), "norm_pos_x: 'left'"),
        (GAZEPOINT.replace("0.4,1,", "0.4,7,"), "gaze.csv:2: BPOGV: '7'"), (NEON.replace("500.0,250.0,1,1,", "inf,250.0,1,1,"), "gaze x"),
    ],
)  # fmt: skip
def test_mistake_has_its_place(tmp_path: Path, text: str, says: str) -> None:
    broken = text.replace("5000.504,0,0.2", "5000.504,0,2.0") if says == "gaze.csv:2: " else text
    expected = "gaze.csv:3: confidence: '2.0'" if says == "gaze.csv:2: " else says
    with pytest.raises(MalformedMessage) as e:
        read(tmp_path, broken, screen=SCREEN)
    assert expected in str(e.value)


def test_every_format_is_described() -> None:
    assert ABOUT.keys() == FORMATS.keys()


points = st.lists(st.none() | st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5)), min_size=1, max_size=20)


def pupil_table(samples: list[tuple[float, float] | None]) -> str:
    rows = [
        f"{i / 100!r},{0.0 if p is None else 1.0},{p[0] if p else 0!r},{1 - p[1] if p else 0!r}"
        for i, p in enumerate(samples)
    ]
    return "gaze_timestamp,confidence,norm_pos_x,norm_pos_y\n" + "\n".join(rows) + "\n"


def neon_table(samples: list[tuple[float, float] | None]) -> str:
    rows = [
        f"{10**18 + i * 10**7},{'' if p is None else repr(p[0] * 2000)},{'' if p is None else repr(p[1] * 1000)}"
        for i, p in enumerate(samples)
    ]
    return "timestamp [ns],gaze x [px],gaze y [px]\n" + "\n".join(rows) + "\n"


def tobii_table(samples: list[tuple[float, float] | None]) -> str:
    cells = [("", "") if p is None else (repr(p[0] * 2000), repr(p[1] * 1000)) for p in samples]
    rows = [f"{i * 10}\tEye Tracker\t{x}\t{y}".replace(".", ",") for i, (x, y) in enumerate(cells)]
    return "Recording timestamp [ms]\tSensor\tGaze point X [DACS px]\tGaze point Y [DACS px]\n" + "\n".join(rows) + "\n"


def tobii_eyes_table(samples: list[tuple[float, float] | None]) -> str:
    cells = ["\t\t\t" if p is None else "\t".join([repr(v) for v in (p[0] * 2000, p[1] * 1000)] * 2) for p in samples]
    head = [f"GazePoint{eye}{axis} (ADCSpx)" for eye in ("Left", "Right") for axis in "XY"]
    return (
        "\n".join(["\t".join(["RecordingTimestamp", *head]), *(f"{i * 10}\t{c}" for i, c in enumerate(cells))]) + "\n"
    )


def pupil_surface_table(samples: list[tuple[float, float] | None]) -> str:
    rows = [
        f"{i / 100!r},{p[0] if p else 0!r},{1 - p[1] if p else 0!r},{p is not None},1.0" for i, p in enumerate(samples)
    ]
    return "\n".join(["gaze_timestamp,x_norm,y_norm,on_srf,confidence", *rows]) + "\n"


def neon_surface_table(samples: list[tuple[float, float] | None]) -> str:
    rows = [
        f"{10**18 + i * 10**7},{p is not None},{p[0] if p else ''!r},{p[1] if p else ''!r}"
        for i, p in enumerate(samples)
    ]
    head = "timestamp [ns],gaze detected on surface,gaze position on surface x [normalized],gaze position on surface y [normalized]"
    return "\n".join([head, *rows]).replace("''", "") + "\n"


def gazepoint_table(samples: list[tuple[float, float] | None]) -> str:
    rows = [
        f"{i / 100!r},{p[0] if p else 0!r},{p[1] if p else 0!r},{int(p is not None)}," for i, p in enumerate(samples)
    ]
    return "\n".join(["TIME(2024/05/01 10:00:00.123),BPOGX,BPOGY,BPOGV,", *rows]) + "\n"


TABLES = [
    pupil_table, neon_table, tobii_table, tobii_eyes_table, pupil_surface_table, neon_surface_table, gazepoint_table,
]  # fmt: skip


@pytest.mark.parametrize("table", TABLES)
@given(samples=points)
def test_what_is_written_is_read_back(table: Any, samples: list[tuple[float, float] | None]) -> None:
    with TemporaryDirectory() as folder:
        found = read(Path(folder), table(samples), screen=SCREEN)
    assert len(found) == len(samples)
    for i, (sample, point) in enumerate(zip(found, samples, strict=True)):
        assert sample.t == pytest.approx(i / 100, abs=1e-6)
        assert sample.valid == (point is not None)
        if point is not None:
            assert sample.x is not None
            assert sample.y is not None
            assert math.isclose(sample.x, point[0], abs_tol=1e-9)
            assert math.isclose(sample.y, point[1], abs_tol=1e-9)
