"""The layout for Foxglove: each path is in the schemas, and each panel stands in the layout."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from shift_recording.mcap.schemas import subject_schemas
from shift_runtime.study_files import named_study

LAYOUT = json.loads((Path(__file__).parents[2] / "docs" / "foxglove-layout.json").read_text())
COFFEE = named_study("coffee", Path("nowhere")).study
SCHEMAS = {name: json.loads(text) for name, text in subject_schemas(COFFEE).items()}
PATHS = [path["value"] for panel in LAYOUT["configById"].values() for path in panel.get("paths", ())]


@pytest.mark.parametrize("path", [*PATHS, LAYOUT["configById"]["RawMessages!decision"]["topicPath"]])
def test_path_is_in_the_schema(path: str) -> None:
    topic, *fields = path.removeprefix("/").split(".")
    node: Any = SCHEMAS[topic]
    for field in fields:
        name, index = re.fullmatch(r"(\w+)(\[\d+\])?", field).groups()  # type: ignore[union-attr]
        node = node["properties"][name]
        node = node["items"] if index else node
    assert "type" in node


def test_every_panel_is_placed_once() -> None:
    def placed(node: Any) -> list[str]:
        return [node] if isinstance(node, str) else [*placed(node["first"]), *placed(node["second"])]

    assert sorted(placed(LAYOUT["layout"])) == sorted(LAYOUT["configById"])
