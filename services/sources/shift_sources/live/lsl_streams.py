"""How the channels of a gaze stream of Lab Streaming Layer become samples. Pure.

The convention is XDF's "Gaze-Meta-Data": a channel has a ``type`` (``ScreenX``, ``ScreenY``, ``Diameter``,
``Confidence``, ``ObjectId`` ..), an ``eye``, a ``unit`` and a ``coordinate_system``. Programs follow it in part: Pupil
Labs writes the type as ``metatype``, and others have labels only, so the labels of known programs are recognised too. A
unit is never guessed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from shift_schemas.errors import InvalidSettings

from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Eyes, Sample, lost_sample

LEAST_CONFIDENCE = 0.6
"""Pupil Labs' documentation recommends to leave out gaze below this confidence."""
MISSING = -32768.0
"""EyeLink's value for missing data."""
LEFT, RIGHT, BOTH = "left", "right", "both"
NORMALISED = frozenset({"normalized", "normalised", "norm", "normalized coordinates", "screencoords"})
PIXELS = frozenset({"pixels", "pixel", "px"})
UNITS = ("normalised", "pixels")
ORIGINS = ("top-left", "bottom-left")


class Channel(NamedTuple):
    """One channel as the stream describes it; empty where it says nothing."""

    label: str = ""
    type: str = ""
    eye: str = ""
    unit: str = ""
    coordinate_system: str = ""


class Stream(NamedTuple):
    """A stream as it announces itself."""

    name: str
    type: str
    rate_hz: float
    """0 for a stream without a fixed rate."""
    text: bool
    """Whether its values are texts."""
    channels: tuple[Channel, ...] = ()
    host: str = ""
    source_id: str = ""

    @property
    def has_gaze(self) -> bool:
        """Whether it is a gaze stream by its type or its name."""
        return not self.text and (self.type.lower() in ("gaze", "eyetracking") or self.name == "EyeLink")

    @property
    def has_markers(self) -> bool:
        """Whether it is a stream of markers."""
        return self.text or self.type.lower() in ("markers", "marker", "event", "events")

    @property
    def line(self) -> str:
        """What a list says of it."""
        rate = f"{self.rate_hz:g} Hz" if self.rate_hz else "irregular"
        return f"{self.name!r}, type {self.type or '-'}, {len(self.channels)} channels, {rate}, on {self.host or '-'}"


class _Eye(NamedTuple):
    """The channels of the point of one eye, or of both together; ``valid`` is None where there is none."""

    x: int
    y: int
    valid: int | None


class GazeMapping(NamedTuple):
    """Which channels are what. :meth:`sample` makes samples of them."""

    left: _Eye | None
    right: _Eye | None
    both: _Eye | None
    eyes: tuple[int | None, ...]
    """The channels of :class:`Eyes`, in its order."""
    confidence: int | None
    object_id: int | None
    width: float
    """What x is divided by."""
    height: float
    flip: bool
    """Whether y rises from the bottom to the top."""

    def sample(self, t: float, values: Sequence[Any]) -> Sample:
        """Return the sample: the mean of the eyes that are valid, 0..1 from the upper left corner."""
        eyes = Eyes(
            *(_positive(values[i], name) if i is not None else None
              for i, name in zip(self.eyes, Eyes._fields, strict=True))
        )  # fmt: skip
        if self.confidence is not None and not _at_least(values[self.confidence], LEAST_CONFIDENCE):
            return lost_sample(t, eyes)
        points = [point for eye in (self.left, self.right, self.both) if eye and (point := self._point(eye, values))]
        if not points:
            return lost_sample(t, eyes)
        x = sum(point[0] for point in points) / len(points) / self.width
        y = sum(point[1] for point in points) / len(points) / self.height
        return Sample(t, x, 1 - y if self.flip else y, True, eyes)

    def object(self, values: Sequence[Any]) -> str:
        """Return what the stream says that gaze met; '' is nothing. A whole number has no decimals."""
        value = values[self.object_id] if self.object_id is not None else ""
        if isinstance(value, str):
            return value.strip()
        return "" if not math.isfinite(value) else f"{value:.10g}"

    def _point(self, eye: _Eye, values: Sequence[Any]) -> tuple[float, float] | None:
        x, y = values[eye.x], values[eye.y]
        if not (math.isfinite(x) and math.isfinite(y)) or MISSING in (x, y):
            return None
        if eye.valid is not None and not _at_least(values[eye.valid], 0.5):
            return None
        return x, y


def mapping_of(stream: Stream, screen: ScreenSize | None = None, unit: str = "", origin: str = "") -> GazeMapping:
    """Return how a stream's channels become samples.

    Parameters
    ----------
    screen
        The size in pixels, for streams in pixels.
    unit, origin
        ``normalised`` or ``pixels``, ``top-left`` or ``bottom-left``, in place of what the stream says.

    Raises
    ------
    InvalidSettings
        The stream has no points, does not say their unit, or is in pixels and ``screen`` is not given.
    """
    channels = stream.channels
    found = {eye: _eye_of(channels, eye) for eye in (LEFT, RIGHT, BOTH)}
    pairs = [eye for eye in found.values() if eye is not None]
    object_id = _first(channels, lambda c: c.type == "ObjectId" or c.label.lower() in ("objectid", "object_id"))
    if not pairs and object_id is None:
        labels = ", ".join(c.label or c.type or "?" for c in channels) or "none"
        raise InvalidSettings(
            f"stream {stream.name!r} has no channels with the point of gaze (type ScreenX and ScreenY, or labels of a "
            f"known program); its channels: {labels}"
        )
    width = height = 1.0
    if pairs and (unit or _unit_of(stream, channels[pairs[0].x])) == "pixels":
        if screen is None:
            raise InvalidSettings(
                f"stream {stream.name!r} is in pixels: give the size of the screen, or of the scene camera's picture, "
                "with --screen, such as --screen 1920x1080"
            )
        width, height = float(screen.width), float(screen.height)
    flip = bool(pairs) and (origin or _origin_of(channels[pairs[0].y])) == "bottom-left"
    return GazeMapping(
        found[LEFT], found[RIGHT], found[BOTH] if found[LEFT] is None and found[RIGHT] is None else None,
        tuple(_of(channels, *name.split("_")) for name in Eyes._fields),
        _first(channels, lambda c: c.type == "Confidence" or c.label.lower() == "confidence"), object_id, width, height,
        flip,
    )  # fmt: skip


# --- what a channel is ---


def _eye_of(channels: Sequence[Channel], eye: str) -> _Eye | None:
    x, y = (_first(channels, lambda c, axis=axis: _axis(c) == axis and side_of(c) == eye) for axis in "xy")
    if x is None or y is None:
        return None
    return _Eye(x, y, _of(channels, "valid", eye))


def _of(channels: Sequence[Channel], kind: str, eye: str) -> int | None:
    return _first(channels, lambda c: _kind(c) == kind and side_of(c) == eye)


LABELS_X = re.compile(
    r"x|norm_pos_x|(gaze_?)?x|(left|right)_x|(left|right)eyex|x\.position_on_display_area\.gaze_point\.(left|right)_eye"
)
"""The labels of x of Pupil Labs, App-TobiiPro, App-EyeLink and TittaLSL."""
LABELS_Y = re.compile(
    r"y|norm_pos_y|(gaze_?)?y|(left|right)_y|(left|right)eyey|y\.position_on_display_area\.gaze_point\.(left|right)_eye"
)


def _axis(channel: Channel) -> str:
    """Return x or y for a channel with a coordinate of the point of gaze on the screen, else an empty text."""
    if channel.type in ("ScreenX", "ScreenY"):
        return channel.type[-1].lower()
    label = channel.label.lower()
    if channel.type and channel.type.lower() not in ("gaze", "eyetracking", "screencoords", "misc"):
        return ""
    return "x" if LABELS_X.fullmatch(label) else "y" if LABELS_Y.fullmatch(label) else ""


def side_of(channel: Channel) -> str:
    """Return left, right or both: by what the channel says, else by its label."""
    if channel.eye in (LEFT, RIGHT, BOTH):
        return channel.eye
    label = channel.label.lower()
    if label.startswith("diameter0"):
        return RIGHT
    if label.startswith("diameter1"):
        return LEFT
    return LEFT if "left" in label else RIGHT if "right" in label else BOTH


def _kind(channel: Channel) -> str:
    label = channel.label.lower()
    if label.startswith("valid") and "gaze_point" in label:
        return "valid"
    if label.startswith(("valid", "available")):
        return ""
    if "openness" in label:
        return "openness"
    if "pupil" in label or label.startswith("diameter") or channel.type in ("Diameter", "PupilDiameter"):
        return "pupil" if not re.search(r"\b[xyz]\b|position|origin", label) else ""
    return ""


def _unit_of(stream: Stream, channel: Channel) -> str:
    said, label = channel.unit.lower(), channel.label.lower()
    if said in NORMALISED or "display_area" in label or label.startswith("norm_pos"):
        return "normalised"
    if said in PIXELS or stream.name == "EyeLink" or re.fullmatch(r"(left|right)eyex", label):
        return "pixels"
    raise InvalidSettings(
        f"stream {stream.name!r} does not say the unit of {channel.label or channel.type!r} "
        f"({channel.unit or 'nothing'}): say it with --unit normalised or --unit pixels"
    )


def _origin_of(channel: Channel) -> str:
    said = channel.coordinate_system.lower()
    bottom = "bottom" in said or "lower" in said or channel.label.lower().startswith("norm_pos")
    return "bottom-left" if bottom else "top-left"


def _first(channels: Sequence[Channel], fits: Any) -> int | None:
    return next((i for i, channel in enumerate(channels) if fits(channel)), None)


def _at_least(value: float, least: float) -> bool:
    return math.isfinite(value) and value >= least


def _positive(value: float, name: str) -> float | None:
    if not math.isfinite(value) or value < 0 or (name.startswith("pupil") and value == 0):
        return None
    return float(value)
