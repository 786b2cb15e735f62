"""What happened in one session, in the order of time, so that a view can show any point of it. Pure.

A live view and a recording's view use the same history: the live one asks for the newest entry, the recording's for the
entry at the time under its cursor.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Generic, NamedTuple, TypeVar

from shift_schemas.messages import (
    Aois,
    Clock,
    Config,
    Decision,
    Estimate,
    Fact,
    Gaze,
    Marker,
    Observation,
    Override,
    Performance,
    PlacedAoi,
    Policy,
    Session,
    Transition,
)
from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json
from shift_study.study import Study

T = TypeVar("T")
END_OF_TIME = 2**62
"""A time in nanoseconds after every entry: the newest one is wanted."""
LIVE_WINDOW_NS = 200 * NS
"""How much of the gaze and of the observations a live history keeps, ns: the room view shows the last three minutes."""


class Series(Generic[T]):
    """Entries in the order in which they were recorded, with their times in nanoseconds since the epoch.

    A clock that is set back does not reorder entries: the time of an entry is at least the time of its predecessor.
    """

    def __init__(self) -> None:
        self.times: list[int] = []
        self.items: list[T] = []

    def __len__(self) -> int:
        return len(self.items)

    def append(self, ns: int, item: T) -> None:
        """Add an entry at the end."""
        self.times.append(max(ns, self.times[-1]) if self.times else ns)
        self.items.append(item)

    def until(self, ns: int = END_OF_TIME) -> list[T]:
        """Return the entries up to and including a time."""
        return self.items[: bisect_right(self.times, ns)]

    def between(self, first_ns: int, last_ns: int) -> list[tuple[int, T]]:
        """Return the entries after ``first_ns`` up to and including ``last_ns``, with their times."""
        first, last = bisect_right(self.times, first_ns), bisect_right(self.times, last_ns)
        return list(zip(self.times[first:last], self.items[first:last], strict=True))

    def last(self, ns: int = END_OF_TIME) -> T | None:
        """Return the last entry at a time; None before the first."""
        index = bisect_right(self.times, ns)
        return self.items[index - 1] if index else None

    def count(self, ns: int = END_OF_TIME) -> int:
        """Return how many entries there are up to and including a time."""
        return bisect_right(self.times, ns)

    def forget_before(self, ns: int) -> None:
        """Remove the entries before a time, except the last of them."""
        count = bisect_right(self.times, ns) - 1
        if count > 0:
            del self.times[:count], self.items[:count]


class GazeSummary(NamedTuple):
    """One chunk of gaze, without its samples."""

    source: str
    received_ns: int
    samples: int
    valid: int
    """Samples with a position, or on an AOI."""
    first_s: float
    """The source's clock at its first sample."""
    last_s: float
    x: float | None
    """The last valid point, 0..1; None for a source that names AOIs."""
    y: float | None
    aoi: str
    """The last sample's AOI, for a source that names AOIs; '' is no AOI."""
    late: bool


class Places(NamedTuple):
    """Where the AOIs that a gaze source moved are: the last place of each."""

    source: str
    aois: dict[str, PlacedAoi]


class ObservationPoint(NamedTuple):
    """One observation: what charts need of it, and its JSON for everything else."""

    capacity: float
    focus_shift: float
    aoi: str
    gaze: str
    payload: str


@dataclass
class SessionHistory:
    """All facts of one session, by kind."""

    live: bool = True
    """Whether gaze and observations older than :data:`LIVE_WINDOW_NS` are forgotten."""
    sessions: Series[Session] = field(default_factory=Series)
    configs: Series[Config] = field(default_factory=Series)
    observations: Series[ObservationPoint] = field(default_factory=Series)
    gaze: Series[GazeSummary] = field(default_factory=Series)
    decisions: Series[Decision] = field(default_factory=Series)
    performances: Series[Performance] = field(default_factory=Series)
    transitions: Series[Transition] = field(default_factory=Series)
    policies: Series[Policy] = field(default_factory=Series)
    estimates: Series[Estimate] = field(default_factory=Series)
    overrides: Series[Override] = field(default_factory=Series)
    markers: Series[Marker] = field(default_factory=Series)
    places: Series[Places] = field(default_factory=Series)
    clocks: Series[Clock] = field(default_factory=Series)
    revision: int = 0
    """Counts the facts; a view is computed again only if it changed."""

    def apply(self, fact: Fact) -> None:
        """Add one fact."""
        ns = fact.stamp.ns
        self.revision += 1
        match fact:
            case Gaze():
                self.gaze.append(ns, summary_of(fact))
                self._forget(self.gaze, ns)
            case Observation():
                gaze = fact.gaze
                point = ObservationPoint(
                    fact.capacity.value, gaze.focus_shift, gaze.aoi, gaze.category, fact.model_dump_json()
                )
                self.observations.append(ns, point)
                self._forget(self.observations, ns)
            case Decision():
                self.decisions.append(ns, fact)
            case Performance():
                self.performances.append(ns, fact)
            case Transition():
                self.transitions.append(ns, fact)
            case Policy():
                self.policies.append(ns, fact)
            case Estimate():
                self.estimates.append(ns, fact)
            case Aois() if fact.outcome == "applied":
                self.places.append(ns, places_after(self.places.items, fact))
                self._forget(self.places, ns)
            case Clock():
                self.clocks.append(ns, fact)
            case Override():
                self.overrides.append(ns, fact)
            case Marker():
                self.markers.append(ns, fact)
            case Config():
                self.configs.append(ns, fact)
            case Session():
                self.sessions.append(ns, fact)

    def _forget(self, series: Series[T], ns: int) -> None:
        if self.live:
            series.forget_before(ns - LIVE_WINDOW_NS)

    # --- what holds at a time ---

    def session(self, ns: int = END_OF_TIME) -> Session | None:
        """Return the session's state at a time; before its start, its first state."""
        return self.sessions.last(ns) or (self.sessions.items[0] if self.sessions.items else None)

    def study(self, ns: int = END_OF_TIME) -> Study | None:
        """Return the study in force at a time; None before the first configuration."""
        config = self.configs.last(ns)
        return None if config is None else study_from_json(config.study)

    def observation(self, ns: int = END_OF_TIME) -> Observation | None:
        """Return the last observation at a time."""
        point = self.observations.last(ns)
        return None if point is None else _observation(point.payload)

    def ledgers(self, ns: int = END_OF_TIME) -> dict[str, Clock]:
        """Return the last ledger of each gaze source at a time."""
        return {clock.source: clock for clock in self.clocks.until(ns)}

    def performance_of(self, decision_id: str, ns: int = END_OF_TIME) -> Performance | None:
        """Return the report in force of a decision at a time: the last one, since a correction replaces the first."""
        return next((p for p in reversed(self.performances.until(ns)) if p.decision_id == decision_id), None)

    def pending_overrides(self, ns: int = END_OF_TIME) -> dict[str, Override]:
        """Return by task the override that the task's next decision follows."""
        used = {d.override_id for d in self.decisions.until(ns)}
        newest = {o.task: o for o in self.overrides.until(ns)}
        return {task: o for task, o in newest.items() if o.override_id not in used and o.strategy}


@lru_cache(maxsize=64)
def _observation(payload: str) -> Observation:
    return Observation.model_validate_json(payload)


def places_after(before: Sequence[Places], fact: Aois) -> Places:
    """Return the places after a message; an AOI that it does not name, or does not place, stays where it is."""
    last = next((places for places in reversed(before) if places.source == fact.source), None)
    aois = dict(last.aois) if last is not None else {}
    for aoi in fact.aois:
        known = aois.get(aoi.name)
        has_shape = bool(aoi.rectangle or aoi.polygon_x)
        aois[aoi.name] = known.model_copy(update={"visible": aoi.visible}) if known and not has_shape else aoi
    return Places(fact.source, aois)


def summary_of(fact: Gaze) -> GazeSummary:
    """Return a chunk of gaze without its samples."""
    x = y = None
    aoi = ""
    if fact.aoi:
        valid = len(fact.aoi)
        aoi = fact.aoi[-1]
    else:
        valid = sum(fact.valid)
        last = next((i for i in range(len(fact.valid) - 1, -1, -1) if fact.valid[i]), None)
        if last is not None:
            x, y = fact.x[last], fact.y[last]
    return GazeSummary(
        fact.source, fact.stamp.ns, len(fact.t), valid, fact.t[0], fact.t[-1], x, y, aoi, fact.outcome == "late"
    )
