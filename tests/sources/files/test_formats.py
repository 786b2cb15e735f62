"""Reading gaze files: tables of the Tobii TX300 and of Titta."""

from __future__ import annotations

import gzip
from itertools import accumulate
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_sources.files.formats import read_samples
from shift_sources.files.samples import Sample, chunks

RECORDINGS = sorted((Path(__file__).parents[2] / "data" / "gaze").glob("*.tsv.gz"))
TX300 = "Time\tLGazePos2dx\tLGazePos2dy\tLValidity\tRGazePos2dx\tRGazePos2dy\tRValidity\n"
TITTA = "\t".join(
    ["", "device_time_stamp", "system_time_stamp"]
    + [
        f"{eye}_gaze_point_{part}"
        for eye in ("left", "right")
        for part in ("on_display_area_x", "on_display_area_y", "valid")
    ]
)


def read(tmp_path: Path, text: str) -> list[Sample]:
    path = tmp_path / "gaze.tsv"
    path.write_text(text)
    return list(read_samples(path))


@pytest.mark.parametrize("path", RECORDINGS, ids=lambda p: p.name)
def test_a_real_recording_reads_whole(path: Path) -> None:
    found = list(read_samples(path))
    with gzip.open(path, "rt") as lines:
        assert len(found) == len(lines.readlines()) - 1
    assert found[0].t == 0.0
    assert found[-1].t == pytest.approx(len(found) / 300, rel=0.01)
    assert all((s.x is None) == (s.y is None) == (not s.valid) for s in found)
    assert sum(s.valid for s in found) > 0.6 * len(found)


def test_two_eyes_are_their_mean_and_one_is_itself(tmp_path: Path) -> None:
    rows = [
        "1000\t0.2\t0.4\t0\t0.4\t0.6\t1",
        "2000\t0.2\t0.4\t0\t0.4\t0.6\t2",
        "3000\t-1.0000\t-1.0000\t0\t0.4\t0.6\t0",
        "4000\t-1.0\t-1.0\t4\t-1.0\t-1.0\t4",
    ]
    found = read(tmp_path, TX300 + "\n".join(rows) + "\n")
    assert found[0] == Sample(0.0, pytest.approx(0.3), pytest.approx(0.5), True)
    assert found[1] == Sample(0.001, 0.2, 0.4, True)
    assert found[2] == Sample(0.002, 0.4, 0.6, True)
    assert found[3] == Sample(0.003, None, None, False)


def test_a_titta_table_is_read_with_the_trackers_clock(tmp_path: Path) -> None:
    rows = [
        "0\t5000000\t99\t0.2\t0.4\tTrue\t0.4\t0.6\tTrue",
        "1\t5001667\t98\t0.2\t0.4\tTrue\t\t\tFalse",
        "2\t5003333\t97\tnan\tnan\tFalse\tnan\tnan\tFalse",
    ]
    found = read(tmp_path, TITTA + "\n" + "\n".join(rows) + "\n")
    assert found == [
        Sample(0.0, pytest.approx(0.3), pytest.approx(0.5), True),
        Sample(0.001667, 0.2, 0.4, True),
        Sample(0.003333, None, None, False),
    ]


def test_an_older_titta_table_names_validity_otherwise(tmp_path: Path) -> None:
    header = TITTA.replace("_valid", "_validity").replace("device_time_stamp\t", "other\t")
    found = read(tmp_path, header + "\n0\tx\t1000000\t0.2\t0.4\t1\t0.4\t0.6\t0\n")
    assert found == [Sample(0.0, 0.2, 0.4, True)]


def test_plain_and_gzip_are_told_apart_by_content(tmp_path: Path) -> None:
    text = TX300 + "1000\t0.2\t0.4\t0\t0.4\t0.6\t0\n"
    plain, zipped = tmp_path / "a.gz", tmp_path / "b.tsv"
    plain.write_text(text)
    zipped.write_bytes(gzip.compress(text.encode()))
    assert list(read_samples(plain)) == list(read_samples(zipped))


def test_chunks_are_numbered_and_hold_all_samples() -> None:
    taken = list(read_samples(RECORDINGS[0]))
    found = list(chunks(taken, 10, source="tx300"))
    assert [c.seq for c in found] == list(range(66))
    assert {c.source for c in found} == {"tx300"}
    assert [t for c in found for t in c.t] == [s.t for s in taken]
    assert [x for c in found for x in c.x or []] == [s.x for s in taken]
    assert [len(c.t) for c in found][-2:] == [10, 1]


@pytest.mark.parametrize(
    ("row", "field", "value"),
    [
        ("zwei\t0.2\t0.4\t0\t0.4\t0.6\t0", "Time", "zwei"),
        ("1000\t0.2\t0.4\t0\t0.4\t0.6\t0", "Time", "1000"),
        ("\t0.2\t0.4\t0\t0.4\t0.6\t0", "Time", ""),
        ("2000\t0,2\t0.4\t0\t0.4\t0.6\t0", "LGazePos2dx", "0,2"),
        ("2000\t0.2\t0.4\t0\tinf\t0.6\t0", "RGazePos2dx", "inf"),
        ("2000\t0.2\t0.4\t7\t0.4\t0.6\t0", "LValidity", "7"),
        ("2000\t0.2\t0.4", "row", "3 cells"),
    ],
)
def test_a_bad_row_is_named_with_file_line_value_and_rule(tmp_path: Path, row: str, field: str, value: str) -> None:
    with pytest.raises(MalformedMessage) as refused:
        read(tmp_path, TX300 + "1000\t0.2\t0.4\t0\t0.4\t0.6\t0\n" + row + "\n")
    (error,) = refused.value.errors
    assert refused.value.detail.startswith("gaze.tsv:3: ")
    assert (error.field, error.value) == (field, value)
    assert error.rule in refused.value.detail


def test_another_table_is_refused_with_the_columns_that_are_needed(tmp_path: Path) -> None:
    with pytest.raises(MalformedMessage, match=r"gaze.tsv:1: header: .*tx300, titta, .*gaze formats lists"):
        read(tmp_path, "t,x,y\n0,0.5,0.5\n")


def test_a_file_that_is_damaged_binary_or_missing_says_so(tmp_path: Path) -> None:
    cut = tmp_path / "cut.tsv.gz"
    cut.write_bytes(RECORDINGS[0].read_bytes()[:20_000])
    with pytest.raises(MalformedMessage, match="cut off"):
        list(read_samples(cut))
    binary = tmp_path / "binary.tsv"
    binary.write_bytes(bytes(range(128, 256)))
    with pytest.raises(MalformedMessage, match="not text"):
        list(read_samples(binary))
    with pytest.raises(InvalidSettings, match=r"missing\.tsv"):
        list(read_samples(tmp_path / "missing.tsv"))


# --- written and read again ---

coordinates = st.floats(-0.5, 1.5, allow_nan=False).map(lambda v: round(v, 4))
eyes = st.one_of(st.none(), st.tuples(coordinates, coordinates))
rows = st.lists(st.tuples(st.integers(1, 20_000), eyes, eyes), min_size=1, max_size=30)
Eyes = list[tuple[int, tuple[float, float] | None, tuple[float, float] | None]]


def expected(written: Eyes) -> list[Sample]:
    times = list(accumulate(step for step, _, _ in written))
    samples = []
    for t, (_, left, right) in zip(times, written, strict=True):
        seen = [eye for eye in (left, right) if eye is not None]
        x, y = ((sum(e[i] for e in seen) / len(seen)) if seen else None for i in (0, 1))
        samples.append(Sample((t - times[0]) / 1_000_000, x, y, bool(seen)))
    return samples


@given(rows)
def test_written_tx300_table_is_read_again(written: Eyes) -> None:
    lines, t = [], 0
    for step, left, right in written:
        t += step
        cells = [f"{e[0]}\t{e[1]}\t0" if e is not None else "-1.0\t-1.0\t4" for e in (left, right)]
        lines.append(f"{t}\t{cells[0]}\t{cells[1]}")
    with TemporaryDirectory() as folder:
        assert read(Path(folder), TX300 + "\n".join(lines) + "\n") == expected(written)


@given(rows)
def test_written_titta_table_is_read_again(written: Eyes) -> None:
    lines, t = [], 0
    for i, (step, left, right) in enumerate(written):
        t += step
        cells = [f"{e[0]}\t{e[1]}\tTrue" if e is not None else "nan\tnan\tFalse" for e in (left, right)]
        lines.append(f"{i}\t{t}\t{t + 7}\t{cells[0]}\t{cells[1]}")
    with TemporaryDirectory() as folder:
        assert read(Path(folder), TITTA + "\n" + "\n".join(lines) + "\n") == expected(written)
