"""The history of a session: what holds at a time, and what is forgotten."""

from __future__ import annotations

from shift_gateway.web.history import LIVE_WINDOW_NS, Series, SessionHistory, summary_of
from shift_schemas.messages import Gaze
from shift_schemas.timestamps import NS, Stamp


def chunk(second: int, **columns: object) -> Gaze:
    """Return a chunk of two samples."""
    given = {"t": [float(second), second + 0.1], "x": [0.2, 0.0], "y": [0.3, 0.0], "valid": [True, False], **columns}
    return Gaze.model_validate(
        {"session": "s1", "stamp": Stamp.of(second * NS), "source": "tx300", "seq": second, **given}, strict=False
    )


def test_last_entry_at_a_time_is_the_newest_until_then() -> None:
    series: Series[str] = Series()
    for ns, item in ((10, "a"), (20, "b"), (30, "c")):
        series.append(ns, item)
    assert [series.last(ns) for ns in (9, 10, 25, 30)] == [None, "a", "b", "c"]
    assert series.last() == "c"
    assert series.until(20) == ["a", "b"]
    assert series.between(10, 30) == [(20, "b"), (30, "c")]


def test_clock_that_is_set_back_does_not_reorder_entries() -> None:
    series: Series[str] = Series()
    series.append(100, "a")
    series.append(40, "b")
    assert series.until() == ["a", "b"]
    assert series.times == [100, 100]


def test_forgetting_keeps_the_entry_that_still_holds() -> None:
    series: Series[str] = Series()
    for ns in (10, 20, 30):
        series.append(ns, str(ns))
    series.forget_before(25)
    assert series.items == ["20", "30"]


def test_summary_of_points_has_the_last_valid_point_and_the_valid_share() -> None:
    found = summary_of(chunk(5))
    assert (found.samples, found.valid, found.x, found.y, found.first_s, found.last_s) == (2, 1, 0.2, 0.3, 5.0, 5.1)


def test_summary_of_aois_has_no_point() -> None:
    found = summary_of(chunk(5, x=[], y=[], valid=[], aoi=["cup", "robot"]))
    assert (found.valid, found.x, found.aoi) == (2, None, "robot")


def test_live_history_forgets_old_gaze_and_a_recording_s_history_keeps_it() -> None:
    live, recorded = SessionHistory(), SessionHistory(live=False)
    for second in range(0, 2 * LIVE_WINDOW_NS // NS, 10):
        live.apply(chunk(second))
        recorded.apply(chunk(second))
    assert len(recorded.gaze) == 2 * LIVE_WINDOW_NS // NS // 10
    assert len(live.gaze) <= LIVE_WINDOW_NS // NS // 10 + 2
