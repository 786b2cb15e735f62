"""AOIs that were drawn in Tobii Pro Lab (its AOI export, JSON) as the AOIs of a study. Pure.

The file has ``{"Aois": [{"Name", "KeyFrames": [{"IsActive", "Seconds", "Vertices": [{"X", "Y"}, ...]}]}], "Media":
{"Width", "Height"}}``; the corners are in pixels of the medium, from its upper left corner. Learned from files and
programs that labs published; Tobii's own documentation of the file was not seen. Everything else in it is not read.
"""

from __future__ import annotations

import json
import re
from typing import Any, NamedTuple

from pydantic import BaseModel, Field, ValidationError
from shift_schemas.errors import MalformedMessage, malformed


class _Corner(BaseModel):
    x: float = Field(alias="X")
    y: float = Field(alias="Y")


class _KeyFrame(BaseModel):
    active: bool = Field(default=True, alias="IsActive")
    seconds: float = Field(default=0.0, alias="Seconds")
    vertices: list[_Corner] = Field(alias="Vertices", min_length=3)


class _Aoi(BaseModel):
    name: str = Field(alias="Name")
    frames: list[_KeyFrame] = Field(alias="KeyFrames", min_length=1)


class _Media(BaseModel):
    width: float = Field(alias="Width", gt=0)
    height: float = Field(alias="Height", gt=0)


class _File(BaseModel):
    aois: list[_Aoi] = Field(alias="Aois", min_length=1)
    media: _Media = Field(alias="Media")


class ImportedAois(NamedTuple):
    """The AOIs as a study has them, and sentences about what is different from the file."""

    aois: list[dict[str, Any]]
    notes: list[str]


def tobii_aois(text: str, file: str) -> ImportedAois:
    """Return the AOIs of an AOI file of Tobii Pro Lab.

    An AOI has the place of its first key frame in which it is active. Coordinates are rounded to a millionth of the
    medium; what lies beside the medium is cut off at its edge.

    Raises
    ------
    MalformedMessage
        The text is not such a file, or two AOIs would have the same name.
    """
    try:
        data = json.loads(text)
    except ValueError as e:
        raise MalformedMessage(f"{file} is not JSON: {e}") from None
    try:
        found = _File.model_validate(data)
    except ValidationError as e:
        raise malformed(f"{file} is not an AOI file of Tobii Pro Lab", e) from e
    aois: list[dict[str, Any]] = []
    notes: list[str] = []
    for aoi in found.aois:
        name = _id(aoi.name)
        if any(other["name"] == name for other in aois):
            raise MalformedMessage(f"{file}: two AOIs would have the name {name}; rename one of them in Tobii Pro Lab")
        frames = sorted(aoi.frames, key=lambda frame: frame.seconds)
        frame = next((f for f in frames if f.active), frames[0])
        aois.append({"name": name, **_shape(frame.vertices, found.media)})
        notes += _notes(aoi.name, name, frames, frame)
    return ImportedAois(aois, notes)


def _id(name: str) -> str:
    """Return the name as an id: other characters become a hyphen."""
    found = re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-_")[:63]
    return found or "aoi"


def _shape(corners: list[_Corner], media: _Media) -> dict[str, Any]:
    points = [[_share(c.x, media.width), _share(c.y, media.height)] for c in corners]
    xs, ys = sorted({x for x, _ in points}), sorted({y for _, y in points})
    if len(points) == 4 and len(xs) == 2 and len(ys) == 2 and len({tuple(p) for p in points}) == 4:
        return {"rectangle": [xs[0], ys[0], xs[1], ys[1]]}
    return {"polygon": points}


def _share(pixels: float, size: float) -> float:
    return round(min(max(pixels / size, 0.0), 1.0), 6)


def _notes(given: str, name: str, frames: list[_KeyFrame], used: _KeyFrame) -> list[str]:
    notes = [] if given == name else [f"AOI {given!r} is called {name} in the study, since a name is an id"]
    if not used.active:
        notes.append(f"AOI {name} is never active in the file")
    if any(frame.vertices != used.vertices or not frame.active for frame in frames):
        notes.append(
            f"AOI {name} moves or disappears in the file; the study has its first place: send the others to "
            "POST /v1/sessions/S/aois while the session runs"
        )
    return notes
