"""A file that is damaged anywhere is read, or refused in a sentence that begins with its name."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_schemas.messages import GazeChunk
from shift_sources.files.formats import read_gaze
from shift_sources.files.options import Millimetres, Options, Origin, ScreenSize
from shift_sources.files.samples import Sample, chunks

TOBII = "Recording timestamp [ms]\tSensor\tEvent\tGaze point X [DACS px]\tGaze point Y [DACS px]\tValidity left"
HEADS = {
    "tx300": "Time\tLGazePos2dx\tLGazePos2dy\tLValidity\tRGazePos2dx\tRGazePos2dy\tRValidity",
    "tobii": TOBII,
    "pupil": "gaze_timestamp,confidence,norm_pos_x,norm_pos_y",
    "neon": "timestamp [ns],gaze x [px],gaze y [px],worn,blink id",
    "gazepoint": "TIME(2024/05/01),BPOGX,BPOGY,BPOGV,LPMM,LPMMV,AOI",
    "begaze": "RecordingTime [ms],Category Left,Point of Regard Left X [px],Point of Regard Left Y [px],AOI Name Left",
}  # fmt: skip
ROWS = {
    "tx300": "{t}\t0.5\t0.5\t0\t0.5\t0.5\t0",
    "tobii": "{t}\tEye Tracker\t\t100\t200\tValid",
    "pupil": "{t},1.0,0.5,0.5",
    "neon": "{t},100,200,1,",
    "gazepoint": "{t},0.5,0.5,1,3.5,1,cup",
    "begaze": "{t},Fixation,100,200,cup",
    "glasses3": '{{"type":"gaze","timestamp":{t},"data":{{"gaze2d":[0.5,0.5],"eyeleft":{{"pupildiameter":3.5}}}}}}',
    "glasses2": '{{"ts":{t},"s":0,"gidx":{t},"gp":[0.5,0.5]}}',
    "eyelink": "{t}\t100.0\t200.0\t900.0\t...",
    "smi": "{t}\tSMP\t1\t100.0\t200.0",
}
HEADS |= {
    "eyelink": "** A\nMSG\t1 DISPLAY_COORDS 0 0 1919 1079\nSTART\t1\tLEFT\nSAMPLES\tGAZE\tLEFT\nMSG\t2 go",
    "smi": "## Calibration Area:\t1920\t1080\nTime\tType\tTrial\tL POR X [px]\tL POR Y [px]\n1\tMSG\t1\t# Message: go",
}
OPTIONS = Options(screen=ScreenSize(1920, 1080), screen_mm=Millimetres(509, 286), distance_mm=650, origin=Origin.CENTRE)
PIECES = ["", "\t", ",", "\n", "x", "-", "1e999", "nan", "{", "]", '"', "\udc80", "é", "0", "9" * 400, "[" * 2000]


def written(format_: str) -> str:
    rows = [ROWS[format_].format(t=10 * i) for i in range(1, 5)]
    return "\n".join([*([HEADS[format_]] if format_ in HEADS else []), *rows]) + "\n"


def read(text: str, options: Options = OPTIONS) -> list[Sample]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "gaze.txt"
        path.write_bytes(text.encode("utf-8", "surrogateescape"))
        found = read_gaze(path, options)
    sent = list(chunks(found.samples, 100, "file", found.named))
    assert all(isinstance(chunk, GazeChunk) for chunk in sent)
    return found.samples


def refusal(text: str) -> str:
    """Return the sentence that refuses the file; ``read`` if it is read."""
    try:
        read(text)
    except (MalformedMessage, InvalidSettings) as refused:
        return refused.detail
    return "read"


@pytest.mark.parametrize("format_", ROWS)
def test_whole_file_is_read(format_: str) -> None:
    assert Counter(s.valid for s in read(written(format_))) == {True: 4}


@pytest.mark.parametrize("format_", ROWS)
@given(data=st.data())
def test_damaged_file_is_read_or_refused_in_a_sentence(format_: str, data: st.DataObject) -> None:
    text = written(format_)
    for _ in range(data.draw(st.integers(1, 3))):
        begin = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(begin, min(len(text), begin + 8)))
        text = text[:begin] + data.draw(st.sampled_from(PIECES)) + text[end:]
    assert refusal(text).startswith(("gaze.txt", "read"))


@given(st.binary(max_size=200))
def test_any_bytes_are_refused_in_a_sentence(content: bytes) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "gaze.txt"
        path.write_bytes(content)
        with pytest.raises((MalformedMessage, InvalidSettings), match=r"gaze\.txt"):
            read_gaze(path)
