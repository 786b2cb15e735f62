"""Studies by name: ``data/studies/*.yaml`` and the built-in ones."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from shift_schemas.errors import FieldError, InvalidStudy, shorten
from shift_schemas.ids import is_id, not_an_id
from shift_schemas.study_text import parse_study, study_data


def study_named(name: str, folder: Path) -> dict[str, Any]:
    """The study of that name, as a plain object; a file of the folder goes before a built-in one.

    Raises
    ------
    InvalidStudy
        There is none of that name (those that there are are named), or its file has a mistake.
    """
    if not is_id(name):
        raise _refused(name, not_an_id(name))
    for stem, path in _files(folder):
        if stem == name:
            return study_data(parse_study(_text(path), path.name))
    known = ", ".join(sorted({stem for stem, _ in _files(folder)}))
    raise _refused(name, f"there is no study of that name; there are {known}")


def _refused(name: str, rule: str) -> InvalidStudy:
    error = FieldError(field="study", value=shorten(name), rule=rule)
    return InvalidStudy(f"study {error.value!r}: {rule}", (error,))


def _files(folder: Path) -> Iterator[tuple[str, Traversable]]:
    """Stem and file of every study, the folder's before the built-in ones."""
    for place in (folder, files("shift_schemas") / "studies"):
        if not place.is_dir():
            continue
        for path in sorted(place.iterdir(), key=lambda p: p.name):
            if path.name.endswith((".yaml", ".yml")) and path.is_file():
                yield path.name.rsplit(".", 1)[0], path


def _text(path: Traversable) -> str:
    try:
        return path.read_bytes().decode(errors="replace")
    except OSError as e:
        raise InvalidStudy(f"{path.name} cannot be read: {e.strerror}") from e
