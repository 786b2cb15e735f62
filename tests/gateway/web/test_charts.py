"""What the charts of the room view show. The drawing itself is tested in the browser."""

from __future__ import annotations

from shift_gateway.web.charts import strip_marks
from shift_gateway.web.history import SessionHistory
from shift_schemas.messages import Marker
from shift_schemas.timestamps import NS, Stamp


def marker(second: int, name: str, retracts: str = "") -> Marker:
    return Marker(session="s1", stamp=Stamp.of(second * NS), marker_id=name, text=f"note {name}", retracts=retracts)


def labels(*markers: Marker, now_s: int) -> list[str]:
    history = SessionHistory()
    for each in markers:
        history.apply(each)
    return [label for _, label in strip_marks(history, now_s * NS)["markers"]]


def test_retracted_marker_is_not_drawn() -> None:
    assert labels(marker(100, "m1"), marker(101, "m2"), marker(102, "m3", "m1"), now_s=103) == ["note m2"]


def test_marker_is_drawn_as_long_as_it_is_not_retracted() -> None:
    assert labels(marker(100, "m1"), marker(102, "m2", "m1"), now_s=101) == ["note m1"]
