"""A table that the browser fills: the server sends its rows only when they change."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from nicegui import ui

from shift_gateway.web.layout import testid
from shift_gateway.web.table_rows import Heading, Row, heading_data, rows_json


class DataTable:
    """One table with its headings.

    Parameters
    ----------
    name
        Its ``data-testid``.
    label
        What a screen reader says about it.
    """

    def __init__(self, name: str, label: str, headings: Sequence[Heading | str] = (), scrolls: bool = False) -> None:
        self._shown = ""
        self._headings = headings
        region = ui.element("div").classes("table-scroll" + (" high" if scrolls else ""))
        region.props["role"], region.props["aria-label"], region.props["tabindex"] = "region", label, 0
        with region:
            self._table = testid(ui.element("table").classes("plain data"), name)
            self._table.props["aria-label"] = label

    def script(self, rows: Iterable[Row], headings: Sequence[Heading | str] | None = None) -> str:
        """Return the JavaScript that shows the rows; empty if they are shown already."""
        columns = self._headings if headings is None else headings
        data = f"[{json.dumps(heading_data(columns))},{rows_json(rows)}]"
        if data == self._shown:
            return ""
        self._shown = data
        return f"shift.table({self._table.id}, ...{data});"
