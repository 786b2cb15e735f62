"""The monitor's messages: gaze, fixations and the observation of the partner."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator
from shift_model.vocabulary import AwarenessClass, CapacityClass, GazeClass

from shift_schemas.ids import Id
from shift_schemas.messages.base import Count, Fact, GazeOutcome, Message, Seconds, StreamItem, Warnings
from shift_schemas.timestamps import Stamp

EYE_COLUMNS = ("pupil_left", "pupil_right", "openness_left", "openness_right")
"""What a source can send of each eye beside gaze. It is recorded and exported; the model does not use it."""
EyeColumn = list[Annotated[float, Field(ge=0, le=1e6)] | None] | None


class Gaze(Fact):
    """A chunk of gaze as it was applied. Columns of equal length; a lost sample is 0, 0, invalid."""

    owner = "monitor"
    subject = "gaze"

    source: Id = Field(description="The gaze source.")
    seq: Count = Field(description="Number of the chunk within its source, from 0.")
    segment: Count = Field(default=0, description="Counts the restarts of the source's clock or numbering.")
    outcome: GazeOutcome = Field(default="applied", description="late: recorded, not applied.")
    t: list[Seconds] = Field(description="Source clock, s.")
    x: list[float] = Field(default=[], description="0..1 from the left; empty for gaze on AOIs.")
    y: list[float] = Field(default=[], description="0..1 from the top; empty for gaze on AOIs.")
    valid: list[bool] = Field(default=[], description="Whether the sample is valid; empty for gaze on AOIs.")
    aoi: list[str] = Field(default=[], description="AOI names; '' is no AOI. Empty for points.")
    pupil_left: list[float] | None = Field(default=None, description="Pupil size, source's unit; 0 where lost.")
    pupil_right: list[float] | None = Field(default=None, description="Pupil size, source's unit; 0 where lost.")
    openness_left: list[float] | None = Field(default=None, description="Eye openness, source's unit; -1 where lost.")
    openness_right: list[float] | None = Field(default=None, description="Eye openness, source's unit; -1 where lost.")
    round_trip_s: float | None = Field(default=None, description="As the source sent it, s.")
    offset_s: float | None = Field(default=None, description="As the source sent it, s.")
    warnings: Warnings = Field(default=[], description="What was accepted but may be a mistake or has no effect.")


class PlacedAoi(Message):
    """Where an AOI is from a time on, as it is recorded: numbers only, and an empty list where it has no such shape."""

    name: Id = Field(description="The AOI.")
    visible: bool = Field(description="Whether gaze can fall on it.")
    rectangle: list[float] = Field(default=[], description="left, top, right, bottom; empty for a polygon.")
    polygon_x: list[float] = Field(default=[], description="The corners' x; empty for a rectangle.")
    polygon_y: list[float] = Field(default=[], description="The corners' y; empty for a rectangle.")


class Aois(Fact):
    """Areas of interest that moved, as they were applied. An AOI that is not named stays where it is."""

    owner = "monitor"
    subject = "aois"

    source: Id = Field(description="The gaze source on whose clock they move.")
    seq: Count = Field(description="Number of the message within its source, from 0.")
    segment: Count = Field(default=0, description="Counts the restarts of the time or the numbering.")
    outcome: GazeOutcome = Field(default="applied", description="late: recorded, not applied.")
    t: Seconds = Field(description="From when on they hold, source clock, s.")
    aois: list[PlacedAoi] = Field(description="The AOIs that the message names.")
    warnings: Warnings = Field(default=[], description="What was accepted but may be a mistake or has no effect.")


class ClockSegment(Message):
    """What a source sent between two restarts or jumps of its clock."""

    segment: Count = Field(description="Its number, from 0.")
    samples: Count = Field(description="Samples that were applied.")
    start_s: Seconds = Field(description="Its first sample, source clock, s.")
    end_s: Seconds = Field(description="Its last sample, source clock, s.")
    offset_s: float = Field(description="Mesh's clock minus source's clock, the smallest of the segment, s.")
    step_s: float = Field(
        default=0.0, description="How far the source's clock was set forward before it, s; 0 for the first one."
    )
    drift_ppm: float | None = Field(
        default=None, description="How much faster the source's clock ran, millionths; left out below 10 s."
    )


class Clock(Fact):
    """The ledger of a gaze source: what came, what did not, and how its clock ran.

    It is recorded at the session's end; from format 6 on also where a segment begins, and every ten seconds.
    """

    owner = "monitor"
    subject = "clock"

    source: Id = Field(description="The gaze source.")
    chunks: Count = Field(description="Chunks that were applied.")
    samples: Count = Field(description="Samples that were applied.")
    late: Count = Field(description="Chunks that came after a later one: recorded, not applied.")
    missing: Count = Field(description="Chunks that never came, judged by their numbers.")
    repeated: Count = Field(description="Chunks that were sent again with the same content; each counts once.")
    refused: dict[str, Count] = Field(description="Chunks that the monitor refused, by the kind of the problem.")
    restarts: Count = Field(description="How often the source's clock or numbering began anew.")
    rate_hz: float | None = Field(default=None, description="Samples per second of the source's clock.")
    longest_gap_s: float = Field(description="The longest time between two samples of a segment, s.")
    offset_s: float | None = Field(
        default=None, description="Mesh's clock minus source's clock, the smallest of the last segment, s."
    )
    drift_ppm: float | None = Field(
        default=None, description="How much faster the source's clock ran, millionths; left out below 10 s."
    )
    round_trip_s: float | None = Field(
        default=None, description="The smallest round trip to the tracker that the source measured, s."
    )
    source_offset_s: float | None = Field(
        default=None, description="The offset of the two clocks that the source measured last, s."
    )
    segments: list[ClockSegment] | None = Field(
        default=None, description="The last segments, oldest first; left out before format 6."
    )


class Fixation(Fact):
    """A finished fixation, on the source's clock."""

    owner = "monitor"
    subject = "fixation"

    source: Id = Field(description="The gaze source.")
    segment: Count = Field(default=0, description="The segment of the source that it began in.")
    start_s: Seconds = Field(description="Start, source clock, s.")
    duration_s: Annotated[float, Field(ge=0)] = Field(description="Duration, s.")
    x: float = Field(description="Mean position, 0..1 from the left.")
    y: float = Field(description="Mean position, 0..1 from the top.")
    aoi: str = Field(description="The AOI at the mean position; '' is no AOI.")
    aois: list[str] | None = Field(
        default=None, description="Every AOI at the mean position, in the study's order; left out before format 6."
    )


class CapacityView(Message):
    """Processing capacity."""

    value: float = Field(description="Its value.")
    category: CapacityClass = Field(description="low or high.")


class GazeView(Message):
    """The visual distribution of attention."""

    category: GazeClass = Field(description="distracted, uncertain or focused.")
    weights: dict[Id, float] = Field(description="Attention weight per AOI; they sum to 1.")
    focus_shift: float = Field(description="Focus shift, 0..1.")
    aoi: str = Field(description="The held target; '' is no AOI.")
    fixations: Count = Field(description="Finished fixations so far.")
    dropped: Count = Field(description="How many gaze chunks never came, judged by their numbers.")
    restarts: Count | None = Field(default=None, description="How often a source restarted its clock or numbering.")
    samples: Count | None = Field(default=None, description="Samples applied, all sources together.")
    dwell_s: float | None = Field(default=None, description="Dwell on AOIs in this session, s.")
    lost: float | None = Field(default=None, description="Share of the source's time without a valid sample, 0..1.")
    unclassified: float | None = Field(default=None, description="Share of its time in no fixation, 0..1.")
    off_aoi: float | None = Field(default=None, description="Share of its time on no AOI, 0..1.")
    off_stimulus: float | None = Field(
        default=None, description="Share of its time with points outside 0..1; part of unclassified or off_aoi."
    )
    valid: float | None = Field(
        default=None, description="Share of valid samples in the last two seconds of the source's time, 0..1."
    )
    received: Stamp | None = Field(default=None, description="When the last applied sample was received.")
    age_s: float | None = Field(default=None, description="Time since then at the observation's stamp, s.")


class AwarenessView(Message):
    """The awareness in one task, derived from its results."""

    category: AwarenessClass = Field(description="The class.")
    comprehension: float = Field(description="Success ratio over the window.")
    enabledness: float = Field(description="Success ratio over the window.")
    results: Count = Field(description="Results so far.")


class Observation(Fact):
    """The whole partner model."""

    owner = "monitor"
    subject = "observation"
    number = "version"

    version: Count = Field(ge=1, description="Number of the observation, from 1.")
    capacity: CapacityView
    gaze: GazeView
    awareness: dict[Id, AwarenessView] = Field(description="For each task that has results.")
    warnings: Warnings = Field(default=[], description="The warnings of the last gaze and of the last result.")


class GazeChunk(StreamItem):
    """A chunk of gaze, points on the stimulus or AOI names, as a source sends it."""

    owner = "monitor"
    stream = "gaze"

    source: Id = Field(description="The gaze source.")
    seq: Count = Field(description="Number of the chunk within its source, from 0.")
    t: Annotated[list[Seconds], Field(min_length=1)] = Field(description="Rising; seconds of the source's clock.")
    x: list[float | None] | None = Field(default=None, description="0..1 from the left; null where lost.")
    y: list[float | None] | None = Field(default=None, description="0..1 from the top; null where lost.")
    valid: list[bool] | None = Field(default=None, description="Left out: valid wherever x and y are given.")
    aoi: list[str | None] | None = Field(default=None, description="AOI names; null is no AOI.")
    pupil_left: EyeColumn = Field(default=None, description="Pupil size, in the source's unit; null where lost.")
    pupil_right: EyeColumn = Field(default=None, description="Pupil size, in the source's unit; null where lost.")
    openness_left: EyeColumn = Field(default=None, description="Eye openness, in the source's unit; null where lost.")
    openness_right: EyeColumn = Field(default=None, description="Eye openness, in the source's unit; null where lost.")

    round_trip_s: Annotated[float, Field(ge=0, le=3600)] | None = Field(
        default=None, description="The round trip to the tracker that the source measured, s."
    )
    offset_s: Seconds | None = Field(
        default=None, description="The sending computer's clock minus the source's clock, as the source measured it, s."
    )

    @model_validator(mode="after")
    def _columns(self) -> GazeChunk:
        if self.aoi is not None:
            if self.x is not None or self.y is not None or self.valid is not None:
                raise ValueError("give either aoi, or x and y with valid")
            columns: list[tuple[str, list[Any] | None]] = [("aoi", self.aoi)]
        elif self.x is None or self.y is None:
            raise ValueError("give either aoi, or x and y with valid")
        else:
            columns = [("x", self.x), ("y", self.y), ("valid", self.valid)]
        columns += [(name, getattr(self, name)) for name in EYE_COLUMNS]
        for name, column in columns:
            if column is not None and len(column) != len(self.t):
                raise ValueError(f"{name} has {len(column)} entries and t has {len(self.t)}; they must be as many")
        if any(b <= a for a, b in zip(self.t, self.t[1:], strict=False)):
            raise ValueError("t must rise within a chunk")
        if self.valid is not None and self.x is not None and self.y is not None:
            for i, ok in enumerate(self.valid):
                if ok and (self.x[i] is None or self.y[i] is None):
                    raise ValueError(f"sample {i} is valid and has no x or y")
        return self


Coordinate = Annotated[float, Field(ge=-1.0, le=2.0)]
"""0..1 on the stimulus; an AOI that moves may be up to one stimulus beside it, as gaze may."""


class AoiPosition(Message):
    """Where an AOI is from a time on: a rectangle, a polygon, or not visible."""

    name: Id = Field(description="An AOI of the study.")
    rectangle: Annotated[list[Coordinate], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="left, top, right, bottom; 0..1 from the upper left corner, at most -1..2."
    )
    polygon: (
        Annotated[
            list[Annotated[list[Coordinate], Field(min_length=2, max_length=2)]], Field(min_length=3, max_length=256)
        ]
        | None
    ) = Field(default=None, description="The corners, [x, y] each.")
    visible: bool = Field(
        default=True, description="false: gaze does not fall on it. true without a shape: it is where it was last."
    )

    @model_validator(mode="after")
    def _one_shape(self) -> AoiPosition:
        if self.rectangle is not None and self.polygon is not None:
            raise ValueError(f"{self.name}: give either rectangle or polygon")
        if self.rectangle is not None:
            left, top, right, bottom = self.rectangle
            if not (left < right and top < bottom):
                raise ValueError(f"{self.name}: rectangle is left, top, right, bottom: left < right and top < bottom")
        if self.rectangle is None and self.polygon is None and "visible" not in self.model_fields_set:
            raise ValueError(f"{self.name}: give rectangle, polygon, or visible: false")
        return self


class AoiPositions(StreamItem):
    """Areas of interest that moved, as a source sends them. An AOI that is not named stays where it is."""

    owner = "monitor"
    stream = "aois"

    source: Id = Field(description="The gaze source on whose clock they move.")
    seq: Count = Field(description="Number of the message within its source, from 0.")
    t: Seconds = Field(description="From when on they hold; seconds of the gaze source's clock.")
    aois: Annotated[list[AoiPosition], Field(min_length=1, max_length=64)]

    @model_validator(mode="after")
    def _names_once(self) -> AoiPositions:
        names = [aoi.name for aoi in self.aois]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"aois names {twice} twice; one position holds at a time")
        return self
