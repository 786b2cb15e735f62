# ruff: noqa: E501 (the lines of real files are long)
"""Gaze files that are not plain tables: Tobii Glasses, EyeLink and SMI, with their messages."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import GazeFile, read_gaze
from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import NO_EYES, Eyes, Marker, Sample

GLASSES_3 = """{"type":"event","timestamp":0.5,"data":{"tag":"Ada"}}
{"type":"gaze","timestamp":1.25,"data":{"gaze2d":[0.46,0.52],"gaze3d":[1,2,3],"eyeleft":{"pupildiameter":2.5},"eyeright":{"pupildiameter":2.75}}}
{"type":"gaze","timestamp":1.27,"data":{}}
{"type":"gaze","timestamp":1.29,"data":{"gaze2d":[0.5,1.25],"eyeleft":{},"eyeright":{"pupildiameter":2.5}}}
"""
GLASSES_2 = """{"ts":1000,"s":0,"ac":[0.1,-9.8,0.5]}
{"ts":2000,"s":0,"gidx":7,"pd":3.5,"eye":"left"}
{"ts":2000,"s":1,"gidx":7,"pd":0.0,"eye":"right"}
{"ts":2000,"s":0,"gidx":7,"l":33,"gp":[0.25,0.75]}
{"ts":22000,"s":4,"gidx":8,"l":33,"gp":[0.0,0.0]}
"""
EYELINK = """** CONVERTED FROM ada.edf using edfapi 4.2
** RECORDED BY Ada Lovelace
**

>>>>>>> CALIBRATION (HV9,P-CR) FOR LEFT: <<<<<<<<<
MSG\t90 DISPLAY_COORDS 0 0 1919 1079
START\t100 \tLEFT\tSAMPLES\tEVENTS
PRESCALER\t1
VPRESCALER\t1
PUPIL\tAREA
EVENTS\tGAZE\tLEFT\tRATE\t1000.00\tTRACKING\tCR\tFILTER\t2
SAMPLES\tGAZE\tLEFT\tRATE\t1000.00\tTRACKING\tCR\tFILTER\t2\tINPUT
INPUT\t100\t127
100\t  960.0\t  540.0\t  714.0\t    0.0\t...
MSG\t101 TRIAL 1
SFIX L   101
101\t   .\t   .\t    0.0\t    0.0\t...
102\t  192.0\t  108.0\t  700.0\t    0.0\t...
END\t103 \tSAMPLES\tEVENTS\tRES\t  38.54\t  31.12
"""
BINOCULAR = """MSG\t1408659 GAZE_COORDS 0.00 0.00 1919.00 1079.00
SAMPLES\tGAZE\tLEFT\tRIGHT\tRATE\t 500.00\tTRACKING\tCR\tFILTER\t2
START\t1408660 \tLEFT\tRIGHT\tSAMPLES\tEVENTS
1408660\t 960.0\t 540.0\t 288.0\t 192.0\t 108.0\t 305.0\t.....
1408662\t  .\t  .\t   0.0\t 192.0\t 108.0\t 298.0\t.C...
"""
SMI = """## [BeGaze]
## Date:\t08.03.2023 09:25:20
## [Run]
## Subject:\tAda Lovelace
## [Calibration]
## Calibration Area:\t1680\t1050
## [Geometry]
## Stimulus Dimension [mm]:\t474\t297
##
Time\tType\tTrial\tL Dia X [px]\tL Mapped Diameter [mm]\tL POR X [px]\tL POR Y [px]\tR POR X [px]\tR POR Y [px]\tL Event Info
10000000\tSMP\t1\t20\t3.5\t840.00\t525.00\t168.00\t105.00\tFixation
10001000\tMSG\t1\t# Message: START A
10002000\tSMP\t1\t0\t0.00\t0.00\t0.00\t168.00\t105.00\tFixation
10003000\tUE-keyboard\t1\tSpace
10004000\tSMP\t1\t0\t0.00\t0.00\t0.00\t0.00\t0.00\t-
"""
BEGAZE = """RecordingTime [ms],Participant,Category Group,Category Left,Pupil Diameter Left [mm],Point of Regard Right X [px],Point of Regard Right Y [px],Point of Regard Left X [px],Point of Regard Left Y [px],AOI Name Left
100.5,Ada,Eye,Fixation,3.5,168.0,105.0,840.0,525.0,cup
104.5,Ada,Information,-,-,-,-,-,-,-
108.5,Ada,Eye,Blink,0.0,-,-,840.0,525.0,White Space
"""


def read(folder: Path, text: str, encoding: str = "utf-8", **said: Any) -> GazeFile:
    path = folder / "gaze.txt"
    path.write_text(text, encoding=encoding)
    return read_gaze(path, Options(**said))


def near(t: float, x: float | None, y: float | None, eyes: Eyes = NO_EYES) -> Sample:
    return Sample(pytest.approx(t), x and pytest.approx(x), y and pytest.approx(y), x is not None, eyes)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (GLASSES_3, [near(0, 0.46, 0.52, Eyes(2.5, 2.75)), near(0.02, None, None), near(0.04, 0.5, 1.25, Eyes(None, 2.5))]),
        (GLASSES_2, [near(0, 0.25, 0.75, Eyes(3.5)), near(0.02, None, None)]),
        (EYELINK, [near(0, 0.5, 0.5, Eyes(714.0)), near(0.001, None, None), near(0.002, 0.1, 0.1, Eyes(700.0))]),
        (BINOCULAR, [near(0, 0.3, 0.3, Eyes(288.0, 305.0)), near(0.002, 0.1, 0.1, Eyes(None, 298.0))]),
        (SMI, [near(0, 0.3, 0.3, Eyes(3.5)), near(0.002, 0.1, 0.1), near(0.004, None, None)]),
    ],
    ids=["glasses3", "glasses2", "eyelink", "binocular", "smi"],
)  # fmt: skip
def test_file_is_recognised_and_converted(tmp_path: Path, text: str, expected: list[Sample]) -> None:
    found = read(tmp_path, text)
    assert found.samples == expected
    assert "Ada" not in repr(found.samples) + repr(found.markers)


def test_messages_become_markers_with_their_time(tmp_path: Path) -> None:
    assert read(tmp_path, EYELINK).markers == [Marker(-0.01, "DISPLAY_COORDS 0 0 1919 1079"), Marker(0.001, "TRIAL 1")]
    assert read(tmp_path, SMI).markers == [Marker(0.001, "START A")]


def test_gzip_is_read_as_plain_text(tmp_path: Path) -> None:
    zipped = tmp_path / "gazedata.gz"
    zipped.write_bytes(gzip.compress(GLASSES_3.encode()))
    assert read_gaze(zipped) == read(tmp_path, GLASSES_3)
    zipped.write_bytes(gzip.compress(SMI.encode("utf-16")))
    assert read_gaze(zipped) == read(tmp_path, SMI)


def test_remarks_and_messages_may_be_in_another_encoding(tmp_path: Path) -> None:
    found = read(tmp_path, SMI.replace("Ada", "Zoë").replace("START A", "Tür"), "latin-1")
    assert found.samples == read(tmp_path, SMI).samples
    assert found.markers == [Marker(0.001, "T�r")]
    with pytest.raises(MalformedMessage, match="not text"):
        read(tmp_path, SMI.replace("Fixation", "Fixé"), "latin-1")


@pytest.mark.parametrize(
    ("text", "screen"), [(EYELINK.replace("DISPLAY_COORDS", "SCREEN"), "EyeLink"), (SMI.replace("Area", "Size"), "SMI")]
)
def test_screen_that_the_file_does_not_say_is_asked_for(tmp_path: Path, text: str, screen: str) -> None:
    with pytest.raises(InvalidSettings, match=rf"{screen}\) has positions in pixels.*--screen 1920x1080"):
        read(tmp_path, text)
    whole = read(tmp_path, text, screen=ScreenSize(1680, 1050))
    assert whole.samples[0].valid


@pytest.mark.parametrize("text", [EYELINK, SMI])
def test_screen_that_contradicts_the_file_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidSettings, match=r"says that its screen has .* leave --screen out"):
        read(tmp_path, text, screen=ScreenSize(1280, 720))


def test_screen_of_which_the_experiment_wrote_the_size_for_the_last_pixel(tmp_path: Path) -> None:
    text = EYELINK.replace("1919 1079", "1920 1080")
    assert read(tmp_path, text, screen=ScreenSize(1920, 1080)).samples == read(tmp_path, EYELINK).samples


@pytest.mark.parametrize("text", [GLASSES_3, GLASSES_2, EYELINK, SMI])
def test_aoi_names_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidSettings, match="has no AOI names"):
        read(tmp_path, text, named=True)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (GLASSES_3.replace("1.27", "1.2"), "gaze.txt:3: timestamp: '1.2'"),
        (GLASSES_3.replace("[0.46,0.52]", '["left",0.52]'), "gaze.txt:2: gaze2d: '\"left\"'"),
        (GLASSES_3.replace("[0.46,0.52]", "[0.46]"), "gaze.txt:2: gaze2d: '[0.46]'"),
        (GLASSES_3.replace('"data":{}}', '"data":'), "gaze.txt:3: line: "),
        (GLASSES_2.replace('"s":4,', ""), "gaze.txt:5: s: 'null'"),
        (EYELINK.replace("192.0", "19x.0"), "gaze.txt:18: left x: '19x.0'"),
        (EYELINK.replace("102\t", "1020000000000000\t"), "gaze.txt:18: time: '1.02e+12 s after the first sample'"),
        (EYELINK.replace("700.0", "7000000.0"), "gaze.txt:18: pupil_left: '7e+06'"),
        (EYELINK.replace("102\t", "99\t"), "gaze.txt:18: time: '99'"),
        (EYELINK.replace("102\t", "1o2\t"), "gaze.txt:18: time: '1o2'"),
        (EYELINK.replace("102\t", "x102\t"), "gaze.txt:18: line: 'x102"),
        (EYELINK.replace("  192.0\t  108.0\t  700.0\t    0.0\t...", "  192.0"), "gaze.txt:18: row: '102 192.0'"),
        (EYELINK.replace("SAMPLES\tGAZE", "SAMPLES\tHREF"), "gaze.txt:12: SAMPLES: 'HREF'"),
        (EYELINK.replace("SAMPLES\tGAZE", "FRAME\tGAZE"), "gaze.txt:14: row: '100 960.0"),
        (SMI.replace("840.00", "middle"), "gaze.txt:11: L POR X [px]: 'middle'"),
        (SMI.replace("10004000", "10000500"), "gaze.txt:15: Time: '10000500'"),
        (SMI.replace("10004000\tSMP", "SMP"), "gaze.txt:15: row: 'SMP"),
    ],
)
def test_mistake_has_file_line_and_column(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(MalformedMessage) as refused:
        read(tmp_path, text)
    assert refused.value.detail.startswith(says)


# --- written and read again ---

points = st.lists(
    st.none() | st.tuples(*[st.integers(-500, 1500).map(lambda v: v / 1000 + 0.0005)] * 2), min_size=1, max_size=20
)
Points = list[tuple[float, float] | None]


def glasses_3(samples: Points) -> str:
    return "".join(
        json.dumps({"type": "gaze", "timestamp": i / 100, "data": {} if p is None else {"gaze2d": p}}) + "\n"
        for i, p in enumerate(samples)
    )


def glasses_2(samples: Points) -> str:
    return "".join(
        json.dumps({"ts": i * 10_000, "s": int(p is None), "gidx": i, "gp": p or (0, 0)}) + "\n"
        for i, p in enumerate(samples)
    )


def eyelink(samples: Points) -> str:
    rows = [
        f"{1000 + i * 10}\t . \t . \t 0.0\t..." if p is None else f"{1000 + i * 10}\t{p[0] * 1000!r}\t{p[1] * 500!r}\t9.0\t..."
        for i, p in enumerate(samples)
    ]  # fmt: skip
    head = ["MSG\t1 GAZE_COORDS 0.00 0.00 999.00 499.00", "SAMPLES\tGAZE\tRIGHT\tRATE\t100.00"]
    return "\n".join([*head, *rows]) + "\n"


def smi(samples: Points) -> str:
    rows = [
        f"{i * 10_000}\tSMP\t1\t{p[0] * 1000!r}\t{p[1] * 500!r}" if p else f"{i * 10_000}\tSMP\t1\t0.00\t0.00"
        for i, p in enumerate(samples)
    ]
    return "\n".join(["## Calibration Area:\t1000\t500", "Time\tType\tTrial\tR POR X [px]\tR POR Y [px]", *rows]) + "\n"


def begaze(samples: Points) -> str:
    rows = [
        f"{i * 10}\t-\t-" if p is None else f"{i * 10}\t{p[0] * 1000!r}\t{p[1] * 500!r}" for i, p in enumerate(samples)
    ]
    head = "RecordingTime [ms]\tPoint of Regard Binocular X [px]\tPoint of Regard Binocular Y [px]"
    return "\n".join([head, *rows]) + "\n"


@pytest.mark.parametrize("write", [glasses_3, glasses_2, eyelink, smi, begaze])
@given(samples=points)
def test_what_is_written_is_read_back(write: Any, samples: Points) -> None:
    said = {"screen": ScreenSize(1000, 500)} if write is begaze else {}
    with TemporaryDirectory() as folder:
        found = read(Path(folder), write(samples), **said).samples
    assert len(found) == len(samples)
    for i, (sample, point) in enumerate(zip(found, samples, strict=True)):
        assert sample.t == pytest.approx(i / 100, abs=1e-6)
        assert sample.valid == (point is not None)
        if point is not None:
            assert (sample.x, sample.y) == pytest.approx(point, abs=1e-9)


def test_raw_data_of_begaze_are_points_or_names(tmp_path: Path) -> None:
    found = read(tmp_path, BEGAZE, screen=ScreenSize(1680, 1050))
    assert found.samples == [near(0, 0.3, 0.3, Eyes(3.5)), near(0.008, None, None)]
    named = read(tmp_path, BEGAZE, named=True)
    assert [(s.aoi, s.valid) for s in named.samples] == [("cup", True), (None, False)]
    with pytest.raises(InvalidSettings, match="--screen 1920x1080"):
        read(tmp_path, BEGAZE)
    later = "Raw Data Export\n\n" + BEGAZE.replace(",", "\t")
    assert read(tmp_path, later, screen=ScreenSize(1680, 1050)).samples == found.samples
    assert "Ada" not in repr(found)
