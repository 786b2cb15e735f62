"""Names of AOIs in gaze files: the study's name for each, or an error that says how to give it. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from shift_schemas.errors import MalformedMessage
from shift_schemas.ids import is_id, not_an_id

from shift_sources.files.options import Options

Wrong = Callable[[str], MalformedMessage]
"""Returns the error that the place in the file does not follow this rule."""


def study_name(text: str, options: Options, wrong: Wrong, also: Iterable[str] = ()) -> str | None:
    """Return the study's name for the AOI that a file calls ``text``; None if it is no AOI of the study.

    Parameters
    ----------
    also
        Longer names of the same AOI, which ``--aoi-map`` may use as well.

    Raises
    ------
    MalformedMessage
        The name is not an id, and ``--aoi-map`` does not name it.
    """
    for given in (*also, text):
        if given in options.aoi_map:
            return options.aoi_map[given] or None
    if not text:
        return None
    if not is_id(text):
        raise wrong(f"{not_an_id(text)}; name it as the study does, with --aoi-map '{text}=NAME'")
    return text
