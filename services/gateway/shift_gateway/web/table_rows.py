"""The rows of a table that the browser draws (``shift.table`` in ``assets/page.js``), as text. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple


class Button(NamedTuple):
    """A button within a table; a click sends its event with its value to the server."""

    text: str
    event: str
    value: str | float
    label: str
    """What a screen reader says, since the text alone does not name the row."""
    name: str = ""
    """Its ``data-testid``."""


class Cell(NamedTuple):
    """One cell. Its text is never interpreted by the browser."""

    text: str = ""
    small: str = ""
    """A second line in smaller type."""
    heat: float | None = None
    """How strongly the cell is coloured, 0..1; None: not at all."""
    bar: float | None = None
    """The length of a bar under the text, 0..1; None: no bar."""
    classes: str = ""
    name: str = ""
    """Its ``data-testid``."""
    button: Button | None = None


class Row(NamedTuple):
    """One row; its first cell is the row's header."""

    cells: Sequence[Cell | str]
    name: str = ""
    classes: str = ""


class Heading(NamedTuple):
    """The header of a column, with the sentence that explains it."""

    text: str
    explanation: str = ""


def heading_data(headings: Iterable[Heading | str]) -> list[list[str]]:
    """Return the headings as JSON data."""
    return [[h, ""] if isinstance(h, str) else list(h) for h in headings]


def row_data(rows: Iterable[Row]) -> list[dict[str, Any]]:
    """Return the rows as JSON data, without what is left at its default."""
    return [_row_data(row) for row in rows]


def rows_json(rows: Iterable[Row]) -> str:
    """Return the rows as a JSON list; a row that was encoded before is not encoded again."""
    return f"[{','.join(_row_json(row._replace(cells=tuple(row.cells))) for row in rows)}]"


@lru_cache(maxsize=4096)
def _row_json(row: Row) -> str:
    return json.dumps(_row_data(row))


def _row_data(row: Row) -> dict[str, Any]:
    return {"cells": [_cell_data(c) for c in row.cells], **_given({"name": row.name, "classes": row.classes})}


def _cell_data(cell: Cell | str) -> str | dict[str, Any]:
    if isinstance(cell, str):
        return cell
    data = _given(cell._asdict())
    if cell.button is not None:
        data["button"] = cell.button._asdict()
    return data


def _given(data: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in data.items() if value not in ("", None)}
