"""The screen on which gaze was measured."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Screen:
    """The size of the screen in pixels."""

    width: int
    height: int
