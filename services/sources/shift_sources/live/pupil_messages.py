"""The messages of Pupil Core as samples: gaze on the scene, on one surface, or surfaces as AOIs. Pure.

Positions are 0..1 from the lower left corner. A gaze message has ``norm_pos``, ``confidence``, ``timestamp`` and the
pupils that it was made of (``base_data``); a surface message has ``gaze_on_surfaces``. Eye 0 is the right one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from shift_sources.files.samples import Eyes, Sample, lost_sample, named_sample
from shift_sources.live.lsl_streams import LEAST_CONFIDENCE

GAZE, SURFACES = "gaze.", "surfaces."
Message = Mapping[str, Any]


def scene_sample(message: Message) -> Sample:
    """Return gaze in the picture of the scene camera."""
    return _sample(message, _pupils(message), seen=True)


def surface_samples(message: Message) -> list[Sample]:
    """Return gaze on the surface of a message; gaze beside it is lost."""
    return [_sample(gaze, Eyes(), bool(gaze["on_surf"])) for gaze in _by_time(message)]


class SurfacesAsAois:
    """Joins the messages of all surfaces that belong to one picture of the scene camera.

    Parameters
    ----------
    name_of
        Returns the AOI of a surface; None if it is none. Where gaze is on several, the first AOI counts.
    """

    def __init__(self, name_of: Callable[[str], str | None]) -> None:
        self._name_of = name_of
        self._picture: float | None = None
        self._found: dict[float, list[str | None]] = {}

    def add(self, message: Message) -> list[Sample]:
        """Return the samples of the picture before, once a message of another picture comes."""
        done: list[Sample] = []
        if message["timestamp"] != self._picture:
            done = [named_sample(t, next(filter(None, names), None)) for t, names in sorted(self._found.items())]
            self._picture, self._found = message["timestamp"], {}
        surface = self._name_of(message["name"])
        for gaze in _by_time(message):
            names = self._found.setdefault(float(gaze["timestamp"]), [])
            if gaze["on_surf"] and gaze["confidence"] >= LEAST_CONFIDENCE:
                names.append(surface)
        return done


def _by_time(message: Message) -> list[Message]:
    return sorted(message.get("gaze_on_surfaces", ()), key=lambda gaze: gaze["timestamp"])


def _sample(message: Message, eyes: Eyes, seen: bool) -> Sample:
    t = float(message["timestamp"])
    if not seen or message["confidence"] < LEAST_CONFIDENCE:
        return lost_sample(t, eyes)
    x, y = message["norm_pos"][:2]
    return Sample(t, float(x), 1 - float(y), True, eyes)


def _pupils(message: Message) -> Eyes:
    """Return the pupil's size of each eye: in millimetres if the detector is 3D, else in pixels of the eye camera."""
    sizes: dict[int, float] = {}
    for pupil in message.get("base_data", ()):
        if isinstance(pupil, Mapping) and "id" in pupil:
            size = pupil.get("diameter_3d") or pupil.get("diameter")
            if size:
                sizes[int(pupil["id"])] = float(size)
    return Eyes(pupil_left=sizes.get(1), pupil_right=sizes.get(0))
