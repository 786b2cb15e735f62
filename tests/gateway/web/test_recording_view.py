"""The time line and the events of a recording, without a browser."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_gateway.web.history import ObservationPoint
from shift_gateway.web.recording_history import FileEnd, RecordingHistory, SeriesPart, send_history
from shift_gateway.web.recording_view import (
    changed_keys,
    event_rows,
    events,
    recording_head,
    thinned,
    timeline_height,
    timeline_options,
)
from shift_gateway.web.worker_process import Progress
from shift_schemas.messages import Config, Session
from shift_schemas.timestamps import NS, Stamp
from support.recordings import START, decision_fact, finished, interleaved, marker_fact, write_segment

SESSION = Session(
    session="s1", stamp=Stamp.of(START), participant="P01", study="coffee", condition="adaptive", seed=7, state="live",
    started=Stamp.of(START),
)  # fmt: skip


def config(version: int, **study: object) -> Config:
    """A configuration with this study."""
    text = json.dumps({"study": "coffee", **study})
    return Config(session="s1", stamp=Stamp.of(START + version), version=version, study=text)


def at(fact, seconds: float):
    """The fact at another time, seconds from the session's start."""
    return fact.model_copy(update={"stamp": Stamp.of(START + round(seconds * NS))})


def recording(*facts) -> RecordingHistory:
    """A recording of these facts."""
    found = RecordingHistory()
    for fact in (SESSION, *facts):
        found.history.apply(fact)
    return found


def test_time_line_has_a_step_for_each_decision_and_lasts_to_the_end() -> None:
    found = recording(config(1), at(decision_fact(1), 2.0), at(decision_fact(2), 4.0), at(marker_fact(1), 10.0))
    options = timeline_options(found)
    series = {s.get("name", s.get("id")): s for s in options["series"]}
    assert series["state"]["data"][:2] == [[2.0, "engaged_observer"], [4.0, "engaged_observer"]]
    assert series["state"]["data"][-1]["value"] == [10.0, "engaged_observer"]
    assert series["strategy"]["data"][0] == [2.0, "affirmation, none"]
    assert series["markers"]["data"][0]["value"][0] == 10.0
    assert options["xAxis"][0]["max"] == found.length_s == 10.0
    assert options["animation"] is False
    assert timeline_height(options) > 200


def test_empty_recording_has_a_time_line() -> None:
    options = timeline_options(RecordingHistory())
    assert options["xAxis"][0]["max"] == 1.0
    assert recording_head(RecordingHistory(), "s1.mcap").title == "s1.mcap"


def test_events_are_in_the_order_of_time_and_lead_to_it() -> None:
    facts = (config(1), config(2, title="x"), at(decision_fact(1), 2.0), at(marker_fact(1), 1.0))
    found = events(recording(*facts))
    assert [e.kind for e in found] == ["session", "change", "marker", "decision"]
    rows = event_rows(found)
    button = rows[2].cells[0].button
    assert (button.event, button.value, button.text) == ("recording-seek", 1.0, "0:01")


@pytest.mark.parametrize(("blinded", "shown"), [(True, "condition blinded"), (False, "condition adaptive")])
def test_condition_of_a_blinded_study_is_hidden(blinded: bool, shown: str) -> None:
    assert shown in recording_head(recording(config(1, blinded=blinded)), "s1.mcap").facts


def test_change_names_the_keys_that_changed() -> None:
    before, after = config(1, learner={"epsilon": 0.75, "name": "q"}), config(2, learner={"epsilon": 0.2, "name": "q"})
    assert changed_keys(before, after) == "learner.epsilon 0.75 → 0.2"


def test_long_curve_keeps_its_extremes() -> None:
    points = [(float(i), 0.5) for i in range(20_000)]
    points[777], points[15_555] = (777.0, 1.0), (15_555.0, 0.0)
    curve = thinned(points)
    assert len(curve) <= 3000
    assert [777.0, 1.0] in curve
    assert [15_555.0, 0.0] in curve
    assert curve == sorted(curve)


def test_history_that_was_sent_in_parts_is_the_whole_one(tmp_path: Path) -> None:
    whole = finished(tmp_path, [write_segment(tmp_path / "segments", interleaved(500), finish=True)])
    parts: list[object] = []
    send_history(parts.append, str(whole.path))
    found = RecordingHistory()
    for part in parts:
        if isinstance(part, SeriesPart | FileEnd):
            assert isinstance(part, FileEnd) or len(part.items) <= 300
            found.add(part)
    shares = [part.share for part in parts if isinstance(part, Progress)]
    assert shares == sorted(shares)
    assert [d.n for d in found.history.decisions.items] == list(range(1, 501))
    assert len(found.history.gaze) == len(found.history.markers) == 500
    assert found.history.gaze.times == sorted(found.history.gaze.times)
    assert found.reason == "the session has not ended"


def test_file_that_is_cut_off_gives_what_came_before(tmp_path: Path) -> None:
    path = write_segment(tmp_path, interleaved(100))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    parts: list[object] = []
    send_history(parts.append, str(path))
    found = RecordingHistory()
    for part in parts:
        if isinstance(part, SeriesPart | FileEnd):
            found.add(part)
    assert "it was not finished" in found.reason
    assert 0 < len(found.history.decisions) < 100


def test_observation_series_is_part_of_the_time_line() -> None:
    found = recording(config(1))
    found.add(SeriesPart("observations", [START + NS], [ObservationPoint(0.5, 0.1, "cup", "focused", "{}")]))
    assert timeline_options(found)["series"][0]["data"] == [[1.0, 0.5]]
