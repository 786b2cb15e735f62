"""The option ``--screen``: a size in pixels."""

from __future__ import annotations

import re


def pixels_of(text: str) -> tuple[int, int] | None:
    """Return width and height of a text such as ``1920x1080``; None for any other text."""
    match = re.fullmatch(r"\s*(\d{1,5})\s*[xX×]\s*(\d{1,5})\s*", text)
    if match is None or not int(match[1]) or not int(match[2]):
        return None
    return int(match[1]), int(match[2])
