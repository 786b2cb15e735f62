"""The quality of each gaze source: its rate, the share of lost samples, and the age of its last sample. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

from shift_schemas.timestamps import NS

from shift_gateway.web.history import GazeSummary

Level = Literal["ok", "warning", "fault"]
WINDOW_NS = 5 * NS
"""The quality is that of the last five seconds; chosen: long enough for a rate, short enough to see a loss."""
OLD_S, SILENT_S = 1.0, 3.0
"""A last sample older than this is a warning, and a fault; chosen."""
LOSS_WARNING, LOSS_FAULT = 0.2, 0.5
"""A larger share of lost samples is a warning, and a fault; chosen."""


class SourceQuality(NamedTuple):
    """The quality of one gaze source."""

    source: str
    rate_hz: float
    """Samples per second of the source's clock; 0 if unknown."""
    lost: float
    """Share of samples without a position, 0..1."""
    age_s: float
    """Time since the last chunk was received, seconds."""

    @property
    def level(self) -> Level:
        """Whether the source works."""
        if self.age_s > SILENT_S or self.lost > LOSS_FAULT:
            return "fault"
        return "warning" if self.age_s > OLD_S or self.lost > LOSS_WARNING else "ok"

    @property
    def text(self) -> str:
        """The quality in one line, such as ``ok 118 Hz, lost 4 %, 0.1 s``."""
        age = f"{self.age_s:.1f} s" if self.age_s < 100 else f"{self.age_s / 60:.0f} min"
        return f"{self.level} {self.rate_hz:.0f} Hz, lost {self.lost * 100:.0f} %, {age}"

    @property
    def sentence(self) -> str:
        """What the experimenter should know or do."""
        if self.age_s > SILENT_S:
            return f"No gaze for {self.age_s:.0f} s: check the eye tracker and its program."
        if self.lost > LOSS_WARNING:
            share = f"{self.lost * 100:.0f} %"
            return f"{share} of the samples are lost: check the participant's position and the calibration."
        if self.age_s > OLD_S:
            return f"The last gaze came {self.age_s:.1f} s ago; it should come several times a second."
        return f"Gaze comes at {self.rate_hz:.0f} Hz, and {self.lost * 100:.0f} % of the samples are lost."


def qualities(chunks: Iterable[GazeSummary], now_ns: int) -> dict[str, SourceQuality]:
    """Return the quality of each source, from its chunks of the last :data:`WINDOW_NS` before its last one."""
    by_source: dict[str, list[GazeSummary]] = {}
    for chunk in chunks:
        if not chunk.late:
            by_source.setdefault(chunk.source, []).append(chunk)
    return {source: _quality(source, found, now_ns) for source, found in by_source.items()}


def _quality(source: str, chunks: list[GazeSummary], now_ns: int) -> SourceQuality:
    last = chunks[-1]
    recent = [c for c in chunks if c.received_ns > last.received_ns - WINDOW_NS and c.first_s <= last.last_s]
    samples = sum(c.samples for c in recent)
    span_s = last.last_s - recent[0].first_s
    return SourceQuality(
        source=source,
        rate_hz=(samples - 1) / span_s if span_s > 0 and samples > 1 else 0.0,
        lost=1 - sum(c.valid for c in recent) / samples,
        age_s=max(now_ns - last.received_ns, 0) / NS,
    )
