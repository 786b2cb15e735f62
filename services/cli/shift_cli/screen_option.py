"""The option ``--screen``: a size in pixels."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shift_sources.files.options import ScreenSize


def pixels_of(text: str) -> tuple[int, int] | None:
    """Return width and height of a text such as ``1920x1080``; None for any other text."""
    match = re.fullmatch(r"\s*(\d{1,5})\s*[xX×]\s*(\d{1,5})\s*", text)
    if match is None or not int(match[1]) or not int(match[2]):
        return None
    return int(match[1]), int(match[2])


def screen_size(text: str) -> ScreenSize | None:
    """Return the size of ``--screen``, None for an empty text. Raise :class:`InvalidSettings` for another text."""
    from shift_schemas.errors import InvalidSettings
    from shift_sources.files.options import ScreenSize

    if not text:
        return None
    size = pixels_of(text)
    if size is None:
        raise InvalidSettings(f"--screen is {text!r}: write width and height in pixels, such as 1920x1080")
    return ScreenSize(*size)
