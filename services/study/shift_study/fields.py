"""Field types of a study file, and the base of its parts."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

NonNegative = Annotated[float, Field(ge=0, le=1e6)]


Positive = Annotated[float, Field(gt=0, le=1e6)]


Probability = Annotated[float, Field(ge=0, le=1)]


Level = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]


Point = Annotated[list[Probability], Field(min_length=2, max_length=2)]


StimulusFile = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_. -]{0,100}\.(png|jpg|jpeg|svg|webp|PNG|JPG)$")]
"""The name of an image file, without a folder."""


class StudyPart(BaseModel):
    """A part of a study file: immutable, strict, without unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
