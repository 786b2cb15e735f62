"""The shape of a study file: the type, the keys and the default at each path, from the study's models. Pure.

A path is the keys and list indexes from the top: ``("aois", 0, "name")``. A condition consists of parts of a study,
so that the shape below ``("conditions", NAME)`` is that of the study itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from shift_study.study import Study

Path = tuple[str | int, ...]
Kind = Literal["text", "number", "boolean", "mapping", "list", "any"]

CONDITIONS = "conditions"


def dotted(path: Iterable[str | int]) -> str:
    """Return the path as field errors name it: ``aois.0.name``."""
    return ".".join(map(str, path))


def kind_at(path: Path) -> Kind:
    """Return the kind of value at ``path``, or ``any`` if the study has no such path."""
    annotation = annotation_at(path)
    if annotation is None or annotation is Any:
        return "any"
    origin = get_origin(annotation) or annotation
    if origin is Literal or origin is str:
        return "text"
    if origin is bool:
        return "boolean"
    if origin in (int, float):
        return "number"
    return "list" if origin is list else "mapping"


def annotation_at(path: Path) -> Any:
    """Return the type at ``path`` without ``None`` and constraints, or None if the study has no such path."""
    here: Any = Study
    if len(path) >= 2 and path[0] == CONDITIONS:
        here, path = (Study, path[2:]) if len(path) > 2 else (dict[str, Any], ())
    for part in path:
        here = _bare(_inside(here, part))
    return here


def keys_at(path: Path) -> tuple[str, ...]:
    """Return the sorted keys of the mapping at ``path``; the result is empty if any key is allowed."""
    here = annotation_at(path)
    return tuple(sorted(here.model_fields)) if isinstance(here, type) and issubclass(here, BaseModel) else ()


def default_at(path: Path) -> Any:
    """Return the default of a single value, or None if it has none."""
    here: Any = _defaults()
    for part in path:
        try:
            here = here[part]
        except (KeyError, IndexError, TypeError):
            return None
    return None if isinstance(here, (dict, list)) else here


@lru_cache(maxsize=1)
def _defaults() -> dict[str, Any]:
    data: dict[str, Any] = Study(study="default").model_dump(mode="json", exclude_none=True)
    return {key: value for key, value in data.items() if key not in ("study", "aois")}


def _inside(annotation: Any, part: str | int) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        field = annotation.model_fields.get(str(part))
        return field.annotation if field else None
    return get_args(annotation)[-1] if get_origin(annotation) in (dict, list) else None


def _bare(annotation: Any) -> Any:
    """Return X for ``Annotated[X, ...]`` and for ``X | None``."""
    while True:
        origin = get_origin(annotation)
        if origin is Annotated:
            annotation = get_args(annotation)[0]
        elif origin in (Union, UnionType):
            annotation = next(a for a in get_args(annotation) if a is not NoneType)
        else:
            return annotation
