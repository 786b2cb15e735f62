"""The rows of a table as JSON data."""

from __future__ import annotations

import json

from shift_gateway.web.table_rows import Button, Cell, Heading, Row, heading_data, row_data, rows_json


def test_defaults_are_left_out() -> None:
    assert row_data([Row(["grasp", Cell("0.50", bar=0.5), Cell()])]) == [
        {"cells": ["grasp", {"text": "0.50", "bar": 0.5}, {}]}
    ]


def test_zero_is_a_value() -> None:
    assert row_data([Row([Cell("0.00", heat=0.0)], name="r")]) == [
        {"cells": [{"text": "0.00", "heat": 0.0}], "name": "r"}
    ]


def test_button_has_its_event_and_label() -> None:
    (row,) = row_data([Row([Cell(button=Button("undo", "reverse", 3, "undo configuration 3", "undo"))])])
    assert row["cells"][0]["button"] == {
        "text": "undo", "event": "reverse", "value": 3, "label": "undo configuration 3", "name": "undo",
    }  # fmt: skip


def test_headings_have_text_and_explanation() -> None:
    assert heading_data(["n", Heading("score", "why")]) == [["n", ""], ["score", "why"]]


def test_json_of_rows_is_their_data() -> None:
    rows = [Row(["“grasp”", Cell("0.50", bar=0.5)]), Row(["<b>", Cell()], name="r"), Row(["<b>", Cell()], name="r")]
    assert json.loads(rows_json(rows)) == row_data(rows)
