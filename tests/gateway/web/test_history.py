"""The history of a session: what holds at a time, and what is forgotten."""

from __future__ import annotations

from shift_gateway.web.clock_rows import clock_rows
from shift_gateway.web.history import LIVE_WINDOW_NS, Series, SessionHistory, summary_of
from shift_schemas.messages import Aois, Clock, ClockSegment, Gaze, PlacedAoi
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


def moved(second: int, *aois: PlacedAoi, source: str = "tx300") -> Aois:
    return Aois(session="s1", stamp=Stamp.of(second * NS), source=source, seq=second, t=float(second), aois=list(aois))


def test_places_of_areas_that_moved_are_those_of_each_time() -> None:
    history = SessionHistory(live=False)
    history.apply(moved(1, PlacedAoi(name="cup", visible=True, rectangle=[0.0, 0.0, 0.2, 0.2])))
    history.apply(moved(2, PlacedAoi(name="robot", visible=False)))
    history.apply(moved(3, PlacedAoi(name="cup", visible=False)))
    history.apply(moved(4, PlacedAoi(name="cup", visible=True)))
    history.apply(moved(5, PlacedAoi(name="cup", visible=False), source="spare"))
    shown = []
    for second in (1, 2, 3, 4, 5):
        places = history.places.last(second * NS)
        assert places is not None
        shown.append({name: aoi.visible and aoi.rectangle for name, aoi in places.aois.items()})
    cup = [0.0, 0.0, 0.2, 0.2]
    assert shown == [
        {"cup": cup}, {"cup": cup, "robot": False}, {"cup": False, "robot": False}, {"cup": cup, "robot": False},
        {"cup": False},
    ]  # fmt: skip


def ledger(second: int, **fields: object) -> Clock:
    given = {
        "session": "s1", "stamp": Stamp.of(second * NS), "source": "tx300", "chunks": 10, "samples": 100, "late": 0,
        "missing": 0, "repeated": 0, "refused": {}, "restarts": 0, "longest_gap_s": 0.1,
    }  # fmt: skip
    return Clock.model_validate(given | fields, strict=False)


def test_ledgers_are_the_last_ones_of_each_source() -> None:
    history = SessionHistory()
    for fact in (ledger(10), ledger(20, samples=200), ledger(21, source="spare")):
        history.apply(fact)
    assert {source: clock.samples for source, clock in history.ledgers(20 * NS).items()} == {"tx300": 200}
    assert list(history.ledgers()) == ["tx300", "spare"]


def test_ledger_is_shown_with_what_was_not_applied_and_with_the_steps_of_the_clock() -> None:
    steps = [
        ClockSegment(segment=n, samples=5, start_s=0.0, end_s=1.0, offset_s=0.0, step_s=step)
        for n, step in enumerate((0.0, 10.0, 0.001))
    ]
    (row,) = clock_rows({
        "tx300": ledger(
            1, late=2, refused={"malformed": 3}, restarts=2, rate_hz=119.96, drift_ppm=-12.4, offset_s=1.25,
            round_trip_s=0.004, segments=steps,
        )
    })  # fmt: skip
    texts = [cell if isinstance(cell, str) else f"{cell.text} / {cell.small}" for cell in row.cells]
    assert texts == [
        "tx300", "100 / 10 chunks", "120.0 Hz", "0.1 s", "2 late, 3 refused (malformed)", "3 / +10.000 s", "1.250 s",
        "-12 ppm", "4.0 ms",
    ]  # fmt: skip
    (nothing,) = clock_rows({})
    assert str(nothing.cells[0]).startswith("no ledger yet")
