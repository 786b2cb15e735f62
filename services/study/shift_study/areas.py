"""Areas of interest on the stimulus."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator
from shift_schemas.ids import Id

from shift_study.fields import Point, Probability, StudyPart


class Aoi(StudyPart):
    """An area of interest on the stimulus, 0..1 from the upper left corner: a rectangle or a polygon."""

    name: Id = Field(description="Its name, as gaze on AOIs and the weights carry it.")
    rectangle: Annotated[list[Probability], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="left, top, right, bottom; 0..1."
    )
    polygon: Annotated[list[Point], Field(min_length=3, max_length=256)] | None = Field(
        default=None, description="The corners, [x, y] each, 0..1."
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Aoi:
        if (self.rectangle is None) == (self.polygon is None):
            raise ValueError("give either rectangle: [left, top, right, bottom] or polygon: [[x, y], ...]")
        if self.rectangle and not (self.rectangle[0] < self.rectangle[2] and self.rectangle[1] < self.rectangle[3]):
            raise ValueError(_not_left_top_right_bottom(self.name, self.rectangle))
        return self


def _not_left_top_right_bottom(name: str, rectangle: list[float]) -> str:
    left, top, width, height = rectangle
    said = f"rectangle of {name} is left, top, right, bottom: left < right and top < bottom; it is {rectangle}"
    if left + width <= 1 and top + height <= 1 and width > 0 and height > 0:
        meant = f"[{left:g}, {top:g}, {left + width:g}, {top + height:g}]"
        return f"{said}; if left, top, width, height are meant, write {meant}"
    return said
