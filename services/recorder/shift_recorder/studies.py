"""Studies by name: ``data/studies/*.yaml`` and the built-in ones."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

from shift_schemas.errors import FieldError, InvalidStudy, shorten
from shift_schemas.ids import ID_RULE, is_id
from shift_schemas.study_text import parse_study, study_data


def study_named(name: str, folder: Path) -> dict[str, Any]:
    """The study of that name, as a plain object; a file of the folder goes before a built-in one.

    Raises
    ------
    InvalidStudy
        There is none of that name (those that there are are named), or its file has a mistake.
    """
    if not is_id(name):
        raise _refused(name, f"a study's name is an id: {ID_RULE}")
    for path, text in _texts(folder):
        if path == name:
            return study_data(parse_study(text, f"{path}.yaml"))
    known = ", ".join(sorted({path for path, _ in _texts(folder)}))
    raise _refused(name, f"there is no study of that name; there are {known}")


def _refused(name: str, rule: str) -> InvalidStudy:
    error = FieldError(field="study", value=shorten(name), rule=rule)
    return InvalidStudy(f"study {error.value!r}: {rule}", (error,))


def _texts(folder: Path) -> Iterator[tuple[str, str]]:
    """File stem and text of every study, the folder's before the built-in ones."""
    built_in = files("shift_schemas") / "studies"
    for place in (folder, built_in):
        if not place.is_dir():
            continue
        for path in sorted(place.iterdir(), key=lambda p: p.name):
            if path.name.endswith((".yaml", ".yml")):
                yield path.name.rsplit(".", 1)[0], path.read_bytes().decode(errors="replace")
