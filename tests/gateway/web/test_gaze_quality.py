"""The quality of a gaze source: its rate, its loss and its age."""

from __future__ import annotations

import pytest
from shift_gateway.web.gaze_quality import qualities
from shift_gateway.web.history import GazeSummary
from shift_schemas.timestamps import NS


def chunks(rate_hz: float, valid: float, seconds: int = 8, source: str = "tx300") -> list[GazeSummary]:
    """Return one chunk of gaze a second; its last one is received at ``seconds``."""
    count = int(rate_hz)
    return [
        GazeSummary(
            source, (i + 1) * NS, count, round(valid * count), i, i + (count - 1) / rate_hz, 0.5, 0.5, "", False
        )
        for i in range(seconds)
    ]


def test_rate_and_loss_are_those_of_the_last_five_seconds() -> None:
    found = qualities([*chunks(120, 0.96)], 8 * NS + NS // 10)["tx300"]
    assert found.rate_hz == pytest.approx(120, rel=0.01)
    assert found.lost == pytest.approx(0.04, abs=0.005)
    assert found.text == "ok 120 Hz, lost 4 %, 0.1 s"


@pytest.mark.parametrize(
    ("valid", "age_s", "level"),
    [(1.0, 0.1, "ok"), (0.7, 0.1, "warning"), (0.4, 0.1, "fault"), (1.0, 1.5, "warning"), (1.0, 4.0, "fault")],
)
def test_loss_and_age_decide_the_level(valid: float, age_s: float, level: str) -> None:
    found = qualities(chunks(100, valid), int((8 + age_s) * NS))["tx300"]
    assert found.level == level
    assert found.text.startswith(level)
    assert found.sentence.endswith(".")


def test_each_source_is_judged_by_itself() -> None:
    found = qualities([*chunks(120, 1.0), *chunks(60, 0.1, source="webcam")], 8 * NS)
    assert {name: q.level for name, q in found.items()} == {"tx300": "ok", "webcam": "fault"}


def test_source_whose_clock_restarted_has_a_rate_again() -> None:
    before = [c._replace(first_s=c.first_s + 1000, last_s=c.last_s + 1000) for c in chunks(120, 1.0, 4)]
    after = [c._replace(received_ns=c.received_ns + 4 * NS) for c in chunks(120, 1.0, 4)]
    assert qualities([*before, *after], 8 * NS)["tx300"].rate_hz == pytest.approx(120, rel=0.01)


def test_late_chunks_do_not_count() -> None:
    assert qualities([c._replace(late=True) for c in chunks(120, 1.0)], 8 * NS) == {}
