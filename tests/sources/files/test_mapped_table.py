"""Tables whose columns the command line names: units, origins, signs of loss, and what is asked for."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import FORMATS, GazeFile, read_gaze, read_samples
from shift_sources.files.options import Millimetres, Options, Origin, ScreenSize, lost_of, millimetres_of, origin_of
from shift_sources.files.samples import Eyes

OWN = """# made by our own program
time,gaze x,gaze y,ok,pl
100,480,270,1,3.5
110,-1,270,1,-1
120,480,9999,1,.
130,480,270,0,3.0
"""
MAP = "t=time:ms,x=gaze x:px,y=gaze y:px,valid=ok,pupil_left=pl"
GAZEBASE = "n,x,y,val,xT,yT,dP,lab\n0,0.0,10.0,0,0,0,3000,1\n1,NaN,NaN,4,0,0,NaN,0\n"
GAZEBASE_MAP = "t=n:ms,x=x:deg,y=y:deg,valid=val:0,pupil_left=dP"
SCREEN = ScreenSize(1920, 1080)


def read(folder: Path, text: str, columns: str, **said: Any) -> GazeFile:
    path = folder / "own.csv"
    path.write_text(text, encoding="utf-8")
    return read_gaze(path, Options(columns=columns, **said))


def points(found: GazeFile) -> list[tuple[float | None, float | None]]:
    return [(s.x, s.y) for s in found.samples]


def test_columns_units_and_signs_of_loss_are_as_the_line_says(tmp_path: Path) -> None:
    found = read(tmp_path, OWN, MAP, screen=SCREEN, lost=lost_of("-1, 9999"))
    assert [(s.x, s.y, s.valid) for s in found.samples] == [
        (0.25, 0.25, True), (None, None, False), (None, None, False), (None, None, False),
    ]  # fmt: skip
    assert [s.t for s in found.samples] == pytest.approx([0, 0.01, 0.02, 0.03])
    assert [s.eyes for s in found.samples] == [Eyes(3.5), Eyes(), Eyes(), Eyes(3.0)]


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        (None, (0.25, 0.25)), (Origin.TOP_LEFT, (0.25, 0.25)), (Origin.BOTTOM_LEFT, (0.25, 0.75)),
        (Origin.CENTRE, (0.75, 0.25)), (Origin.CENTRE_DOWN, (0.75, 0.75)),
    ],
)  # fmt: skip
def test_origin_is_as_the_line_says(tmp_path: Path, origin: Origin | None, expected: tuple[float, float]) -> None:
    assert points(read(tmp_path, OWN, MAP, screen=SCREEN, origin=origin))[0] == expected


def test_gazebase_is_in_degrees_from_the_centre(tmp_path: Path) -> None:
    found = read(
        tmp_path, GAZEBASE, GAZEBASE_MAP, screen_mm=Millimetres(474, 297), distance_mm=550, origin=Origin.CENTRE
    )
    up = 0.5 - 550 * math.tan(math.radians(10)) / 297
    assert [(s.x, s.y) for s in found.samples] == [(0.5, pytest.approx(up)), (None, None)]
    assert found.samples[0].eyes == Eyes(3000.0)


def test_two_eyes_are_their_mean_and_each_has_its_validity(tmp_path: Path) -> None:
    text = (
        "s\tlx\tly\tlv\trx\try\trv\n0\t0,2\t0,4\t0\t0,4\t0,6\t1\n1\t0,2\t0,4\t0\t0,4\t0,6\t4\n2\t\t\t0\t0,4\t0,6\t4\n"
    )
    columns = "t=s:s,left_x=lx:norm,left_y=ly:norm,left_valid=lv:0|1,right_x=rx:norm,right_y=ry:norm,right_valid=rv:0|1"
    found = points(read(tmp_path, text, columns))
    assert found[0] == pytest.approx((0.3, 0.5))
    assert found[1:] == [(0.2, 0.4), (None, None)]


def test_names_of_aois_are_taken_where_there_are_no_points(tmp_path: Path) -> None:
    text = "us;target\n0;cup\n100000;\n200000;lost\n"
    found = read(tmp_path, text, "t=us:us,aoi=target", lost=("lost",))
    assert found.named
    assert [(s.aoi, s.valid) for s in found.samples] == [("cup", True), (None, True), (None, False)]
    both = "time,gx,gy,target\n0,0.5,0.5,cup\n"
    assert not read(tmp_path, both, "t=time:s,x=gx:norm,y=gy:norm,aoi=target").named
    assert read(tmp_path, both, "t=time:s,x=gx:norm,y=gy:norm,aoi=target", named=True).samples[0].aoi == "cup"


def test_validity_of_names_is_as_the_line_says(tmp_path: Path) -> None:
    text = "time,target,ok\n0,cup,1\n1,cup,0\n"
    found = read(tmp_path, text, "t=time:s,aoi=target,valid=ok")
    assert [(s.aoi, s.valid) for s in found.samples] == [("cup", True), (None, False)]


def test_names_of_columns_may_have_colons_and_commas(tmp_path: Path) -> None:
    text = 'TIME(10:00:00),"x, left",y\n1,0.5,0.25\n'
    assert points(read(tmp_path, text, "t=TIME(10:00:00):s,x=x, left:norm,y=y:norm")) == [(0.5, 0.25)]


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ("t=time,x=gaze x:px,y=gaze y:px", "t=time does not end in a unit: write t=COLUMN: and one of s, ms, us, ns"),
        ("t=time:ms,x=gaze x,y=gaze y:px", "x=gaze x does not end in a unit"),
        ("t=time:msec,x=gaze x:px,y=gaze y:px", "did you mean 'ms'"),
        ("t=tim:ms,x=gaze x:px,y=gaze y:px", "no column 'tim' for t; it has time, gaze x, .*did you mean 'time'"),
        ("t=time:ms,x=gaze x:px", "needs x and y together"),
        ("t=time:ms", "needs x and y, or aoi"),
        ("x=gaze x:px,y=gaze y:px", "needs t"),
        ("t=time:ms,x=gaze x:px,y=gaze y:mm", "positions are in mm, px: give them one unit"),
        ("t=time:ms,pupil=pl", "'pupil' is none of .*did you mean 'pupil_left'"),
        ("t=time:ms,t=time:s", "t is given twice"),
        ("time", "write FIELD=COLUMN:UNIT"),
        ("t=time:ms,x=gaze x:px,y=gaze y:px,left_valid=ok", "left_valid needs left_x and left_y"),
        ("t=time:ms,x=gaze x:px,y=gaze y:px,left_x=gaze x:px,left_y=gaze y:px", "either x and y, or left_x"),
    ],
)
def test_map_that_is_wrong_is_explained(tmp_path: Path, columns: str, says: str) -> None:
    with pytest.raises(InvalidSettings, match=says):
        read(tmp_path, OWN, columns, screen=SCREEN)


@pytest.mark.parametrize(
    ("unit", "said", "asks"),
    [
        ("px", {}, "--screen 1920x1080"),
        ("mm", {}, "--screen-mm"),
        ("deg", {}, "--screen-mm"),
        ("deg", {"screen_mm": Millimetres(509, 286)}, "--distance-mm"),
        ("deg", {"screen_mm": Millimetres(509, 286), "distance_mm": 650}, "--origin centre"),
    ],
)
def test_what_a_unit_needs_is_asked_for(tmp_path: Path, unit: str, said: dict[str, Any], asks: str) -> None:
    with pytest.raises(InvalidSettings, match=asks):
        read(tmp_path, OWN, MAP.replace("px", unit), **said)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (OWN.replace("-1,270", "left,270"), "own.csv:4: gaze x: 'left'"),
        (OWN.replace("120,", "105,"), "own.csv:5: time: '105'"),
        (OWN.replace("9999,1", "9999,maybe"), "own.csv:5: ok: 'maybe'"),
        (OWN.replace("130,480,270,0,3.0", "130,480"), "own.csv:6: row: '2 cells'"),
    ],
)
def test_mistake_has_file_line_and_column(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(MalformedMessage) as refused:
        read(tmp_path, text, MAP, screen=SCREEN)
    assert refused.value.detail.startswith(says)


def test_map_and_format_fit_each_other(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(OWN)
    with pytest.raises(InvalidSettings, match="needs --columns"):
        list(read_samples(tmp_path / "own.csv", SCREEN, "columns"))
    with pytest.raises(InvalidSettings, match="leave --format neon or --columns out"):
        read_gaze(tmp_path / "own.csv", Options(columns=MAP), "neon")
    with pytest.raises(MalformedMessage, match="any other table is read with --columns"):
        read_gaze(tmp_path / "own.csv")
    assert "columns" in FORMATS


def test_options_are_read_from_texts() -> None:
    assert millimetres_of("509 x 286.5") == Millimetres(509, 286.5)
    assert millimetres_of("") is None
    assert origin_of("bottom-left") is Origin.BOTTOM_LEFT
    assert origin_of("") is None
    with pytest.raises(InvalidSettings, match="--screen-mm is '0x286'"):
        millimetres_of("0x286")
    with pytest.raises(InvalidSettings, match="did you mean 'centre'"):
        origin_of("center")


@given(
    samples=st.lists(st.none() | st.tuples(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5)), min_size=1, max_size=20),
    origin=st.sampled_from(Origin),
    unit=st.sampled_from([("norm", 1.0, 1.0), ("px", 1920.0, 1080.0), ("mm", 509.0, 286.0)]),
)
def test_what_is_written_is_read_back(
    samples: list[tuple[float, float] | None], origin: Origin, unit: tuple[str, float, float]
) -> None:
    name, width, height = unit
    left = 0.5 if origin in (Origin.CENTRE, Origin.CENTRE_DOWN) else 0.0
    top = {Origin.TOP_LEFT: 0.0, Origin.BOTTOM_LEFT: 1.0}.get(origin, 0.5)
    down = 1 if origin in (Origin.TOP_LEFT, Origin.CENTRE_DOWN) else -1
    rows = [
        f"{i}\t-99\t-99" if p is None else f"{i}\t{(p[0] - left) * width!r}\t{(p[1] - top) * down * height!r}"
        for i, p in enumerate(samples)
    ]
    with TemporaryDirectory() as folder:
        found = read(
            Path(folder), "\n".join(["k\ta\tb", *rows]) + "\n", f"t=k:ms,x=a:{name},y=b:{name}", origin=origin,
            screen=SCREEN, screen_mm=Millimetres(509, 286), lost=("-99",),
        )  # fmt: skip
    assert [s.valid for s in found.samples] == [p is not None for p in samples]
    for i, (sample, point) in enumerate(zip(found.samples, samples, strict=True)):
        assert sample.t == pytest.approx(i / 1000)
        if point is not None:
            assert (sample.x, sample.y) == pytest.approx(point, abs=1e-9)
