"""AOI files of Tobii Pro Lab become the AOIs of a study."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from shift_schemas.errors import MalformedMessage
from shift_study.loading import parse_study
from shift_study.tobii_aois import tobii_aois

SQUARE = [(192, 108), (960, 108), (960, 540), (192, 540)]
TRIANGLE = [(0, 0), (1920, 0), (960, 2000)]


def frame(corners: list[tuple[float, float]], seconds: float = 0.0, active: bool = True) -> dict[str, Any]:
    return {"IsActive": active, "Seconds": seconds, "Vertices": [{"X": x, "Y": y} for x, y in corners]}


def aoi(name: str, *frames: dict[str, Any]) -> dict[str, Any]:
    return {"Blue": 1, "Green": 2, "Red": 3, "Name": name, "Tags": [], "KeyFrames": list(frames)}


def file(*aois: dict[str, Any]) -> str:
    media = {"MediaType": 1, "Height": 1080, "Width": 1920, "MediaCount": 1, "DurationMicroseconds": 1000}
    return json.dumps({"Aois": list(aois), "Tags": [], "Media": media, "Version": 2})


def test_pixels_become_shares_of_the_medium() -> None:
    found = tobii_aois(file(aoi("cup", frame(SQUARE)), aoi("table", frame(TRIANGLE))), "scene.aois")
    assert found.aois == [
        {"name": "cup", "rectangle": [0.1, 0.1, 0.5, 0.5]},
        {"name": "table", "polygon": [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]},
    ]
    assert found.notes == []


def test_name_becomes_an_id_and_a_moving_aoi_has_its_first_active_place() -> None:
    moved = aoi("Red cup (1)", frame(SQUARE, 4.0), frame(TRIANGLE, 2.0, active=False), frame(TRIANGLE, 3.0))
    found = tobii_aois(file(moved), "scene.aois")
    assert found.aois == [{"name": "Red-cup-1", "polygon": [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]}]
    assert [note.split(" in the ")[0] for note in found.notes] == [
        "AOI 'Red cup (1)' is called Red-cup-1", "AOI Red-cup-1 moves or disappears",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("{", "is not JSON"),
        ("[]", "is not an AOI file of Tobii Pro Lab"),
        (json.dumps({"Aois": []}), "is not an AOI file of Tobii Pro Lab"),
        (file(aoi("a b", frame(SQUARE)), aoi("a-b", frame(SQUARE))), "two AOIs would have the name a-b"),
        (file(aoi("cup", frame(SQUARE[:2]))), "at least 3"),
    ],
)
def test_another_file_is_refused_with_its_name(text: str, rule: str) -> None:
    with pytest.raises(MalformedMessage, match=rule) as e:
        tobii_aois(text, "scene.aois")
    assert "scene.aois" in e.value.detail


def test_command_prints_a_part_of_a_study_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.aois"
    path.write_text(file(aoi("cup", frame(SQUARE)), aoi("my table", frame(TRIANGLE))), encoding="utf-8-sig")
    done = subprocess.run(
        [sys.executable, "-m", "shift_cli.main", "study", "aois", str(path)], capture_output=True, text=True, check=True
    )
    study = parse_study(f"study: imported\n{done.stdout}")
    assert study.aoi_names == ("cup", "my-table")
    assert "note: AOI 'my table' is called my-table" in done.stderr
