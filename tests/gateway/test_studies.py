"""``/v1/studies``: studies are checked without a session, and a start refuses what the check refuses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from shift_runtime.study_files import study_to_start
from support.gateway_mesh import Mesh

pytestmark = pytest.mark.anyio

BOW_TIE = "study: bow\naois:\n  - {name: cup, polygon: [[0.2, 0.2], [0.8, 0.8], [0.8, 0.2], [0.2, 0.8]]}\n"


@pytest.fixture
def folder(mesh: Mesh) -> Iterator[Path]:
    """Return a folder of studies: a valid one, a doubtful one, and one with a mistake."""
    folder = mesh.data / "studies"
    folder.mkdir(exist_ok=True)
    (folder / "own.yaml").write_text("study: own\ntitle: My own\nconditions: {on: {}, off: {}, 01: {}}\n")
    (folder / "far.yml").write_text("study: far\nfixation: {distance_cm: 650}\n")
    (folder / "bow.yaml").write_text(BOW_TIE)
    yield folder
    for file in folder.iterdir():
        file.unlink()


async def test_every_study_is_listed_with_mistakes_and_warnings(mesh: Mesh, folder: Path) -> None:
    answer = await mesh.ask("GET", "/v1/studies")
    assert answer.status_code == 200
    found = {s["name"]: s for s in answer.json()["studies"]}
    assert list(found) == ["bow", "coffee", "coffee_de", "default", "far", "own"]
    assert found["own"] == {"name": "own", "title": "My own", "mistakes": [], "warnings": []}
    assert found["coffee"]["title"] == "Making coffee with a robot"
    assert found["bow"]["mistakes"][0].startswith("bow.yaml:3: aois.0.polygon: cup crosses itself")
    assert "if 650 mm are meant, write 65" in found["far"]["warnings"][0]


async def test_one_study_is_answered_whole(mesh: Mesh, folder: Path) -> None:
    answer = await mesh.ask("GET", "/v1/studies/own")
    assert answer.status_code == 200
    assert answer.json() == study_to_start("own", folder).data
    assert list(answer.json()["conditions"]) == ["on", "off", "01"]


@pytest.mark.parametrize("name", ["cofee", "..%2Fown", "own.yaml", "%00"])
async def test_unknown_study_is_404(mesh: Mesh, folder: Path, name: str) -> None:
    answer = await mesh.ask("GET", f"/v1/studies/{name}")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    if name == "cofee":
        assert answer.json()["detail"].endswith("bow, coffee, coffee_de, default, far, own; did you mean 'coffee'?")
        assert [(e["field"], e["value"]) for e in answer.json()["errors"]] == [("study", "cofee")]


async def test_study_with_mistakes_is_422_as_at_a_start(mesh: Mesh, folder: Path) -> None:
    read = await mesh.ask("GET", "/v1/studies/bow")
    start = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "study": "bow"})
    assert read.status_code == start.status_code == 422
    assert read.json() == start.json()
    assert read.json()["errors"][0]["field"] == "aois.0.polygon"
    assert read.json()["errors"][0]["value"] == "cup"


async def test_given_study_with_an_impossible_area_is_422_with_the_name(mesh: Mesh) -> None:
    study = {"study": "x", "aois": [{"name": "cup", "polygon": [[0.2, 0.2], [0.5, 0.5], [0.8, 0.8]]}]}
    answer = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "study": study})
    assert answer.status_code == 422
    assert "aois.0.polygon: cup is flat" in answer.json()["detail"]


async def test_conditions_are_as_the_file_has_them(mesh: Mesh, folder: Path) -> None:
    for condition in ("on", "off", "01"):
        start = {"participant": "P01", "study": "own", "condition": condition}
        assert (await mesh.ask("POST", "/v1/sessions", start)).status_code == 201
    answer = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "study": "own", "condition": "of"})
    assert answer.status_code == 422
    assert "has no condition 'of'; it has on, off, 01; did you mean 'off'?" in answer.json()["detail"]
