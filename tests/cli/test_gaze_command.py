"""``shift-mesh gaze``: the list of formats, the order of chunks and markers, and the description of a file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_cli.gaze_playing import check_names, describe, in_order, nothing_counted
from shift_cli.main import app
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import GazeChunk
from shift_sources.files.formats import ABOUT, GazeFile
from shift_sources.files.samples import Marker, Sample
from typer.testing import CliRunner


def samples(n: int) -> list[Sample]:
    return [Sample(i / 10, 0.5, 0.5, True) for i in range(n)]


def test_markers_are_sent_between_the_samples_around_them() -> None:
    found = GazeFile(samples(6), [Marker(0.25, "late"), Marker(-1.0, "early"), Marker(9.0, "end")], named=False)
    sent = [what.text if isinstance(what, Marker) else what.t for _, what in in_order(found, 2, "eyes")]
    assert sent == ["early", [0.0, 0.1], [0.2], "late", [0.3, 0.4], [0.5], "end"]


@given(st.integers(1, 40), st.integers(1, 7), st.lists(st.floats(-1, 5), max_size=5))
def test_chunks_hold_all_samples_in_order_and_are_numbered(n: int, per_chunk: int, times: list[float]) -> None:
    found = GazeFile(samples(n), [Marker(t, "m") for t in times], named=False)
    sent = list(in_order(found, per_chunk, "eyes"))
    chunks = [what for _, what in sent if isinstance(what, GazeChunk)]
    assert [t for chunk in chunks for t in chunk.t] == [s.t for s in found.samples]
    assert [chunk.seq for chunk in chunks] == list(range(len(chunks)))
    assert [t for t, what in sent if isinstance(what, Marker)] == sorted(times)
    assert [t for t, _ in sent] == sorted(t for t, _ in sent)


def test_names_are_described_as_names() -> None:
    found = [Sample(0.0, None, None, True, aoi="cup"), Sample(0.1, None, None, True), Sample(0.2, None, None, False)]
    said = describe([*found, found[1]._replace(t=0.3)], named=True)
    assert said.sentence == "4 samples at 10 Hz, 0.3 s of gaze, lost 25.0%, on no AOI 50.0%"
    assert describe(samples(3)).off_stimulus == 0.0


def test_names_that_count_nowhere_are_explained() -> None:
    said = describe([Sample(0.0, None, None, True), Sample(0.1, None, None, False)], named=True)
    assert "on no AOI; check the names" in nothing_counted(said, True, {}, {})


def test_names_that_the_study_does_not_have_are_explained_before_anything_is_sent() -> None:
    found = GazeFile([Sample(0.0, None, None, True, aoi="robots"), Sample(0.1, None, None, True)], [], named=True)
    config = {"aois": [{"name": "robot"}, {"name": "cup"}]}
    with pytest.raises(MalformedMessage, match=r"have: robots\. The study has robot, cup\. .* did you mean 'robot'"):
        check_names(found, config, "hits.tsv")
    check_names(GazeFile([found.samples[0]._replace(aoi="cup")], [], named=True), config, "hits.tsv")


def test_every_format_is_listed_as_text_and_as_json() -> None:
    text = CliRunner().invoke(app, ["gaze", "formats"]).output
    assert [line.split()[0] for line in text.splitlines()] == list(ABOUT)
    assert json.loads(CliRunner().invoke(app, ["gaze", "formats", "--json"]).output) == {"formats": ABOUT}


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("--screen-mm", "wide", "write width and height in millimetres"),
        ("--origin", "middle", "write top-left"),
        ("--aoi-map", "cup", "'AOI 1=cup'"),
        ("--columns", "t=x", "does not end in a unit"),
    ],
)
def test_wrong_options_are_explained_before_anything_is_sent(
    option: str, value: str, says: str, tmp_path: Path
) -> None:
    file = tmp_path / "gaze.csv"
    file.write_text("x,y\n1,2\n")
    done = CliRunner().invoke(app, ["gaze", "play", str(file), "--session", "s1", option, value])
    assert says in str(done.exception)
