"""Studies by name: the data folder's before the built-in ones, and a name is nothing but a name."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_recorder.studies import study_named
from shift_schemas.errors import InvalidStudy
from shift_schemas.study import Study
from shift_schemas.study_text import study_data, study_of


def test_the_built_in_ones_are_coffee_and_default(tmp_path: Path) -> None:
    coffee, default = study_of(study_named("coffee", tmp_path)), study_of(study_named("default", tmp_path))
    assert coffee.tasks == ["grasp", "turn", "pour"]
    assert list(coffee.conditions) == ["control", "adaptive"]
    assert default.tasks is None
    assert default.aoi_names == ("left", "middle", "right")


def test_the_default_study_has_every_default(tmp_path: Path) -> None:
    plain = study_data(Study(study="default"))
    assert study_named("default", tmp_path) == plain | {"title": study_named("default", tmp_path)["title"]}


def test_without_a_folder_there_are_the_built_in_ones(tmp_path: Path) -> None:
    assert study_named("coffee", tmp_path / "nowhere")["study"] == "coffee"


@pytest.mark.parametrize("suffix", [".yaml", ".yml"])
def test_a_file_of_the_folder_is_found_by_its_name_and_goes_before_a_built_in_one(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"own{suffix}").write_text("study: own\ninteractions: 7\n")
    (tmp_path / f"coffee{suffix}").write_text("study: coffee\ninteractions: 8\n")
    assert study_named("own", tmp_path)["interactions"] == 7
    assert study_named("coffee", tmp_path)["interactions"] == 8


def test_json_is_yaml(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text('{"study": "own", "reward": {"decay": 0.2}}')
    assert study_named("own", tmp_path)["reward"]["decay"] == 0.2


def test_an_unknown_name_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("study: own\n")
    (tmp_path / "notes.txt").write_text("study: notes\n")
    with pytest.raises(InvalidStudy, match="there are coffee, default, own") as refused:
        study_named("notes", tmp_path)
    assert [(e.field, e.value) for e in refused.value.errors] == [("study", "notes")]


@pytest.mark.parametrize(
    "name", ["../own", "**", "own.yaml", "", "own\0", "own\n", "/etc/passwd", "x" * 65536], ids=lambda n: ascii(n)[:20]
)
def test_a_name_that_is_no_id_is_refused_and_no_file_is_looked_for(tmp_path: Path, name: str) -> None:
    (tmp_path / "own.yaml").write_text("study: own\n")
    with pytest.raises(InvalidStudy, match="is not an id") as refused:
        study_named(name, tmp_path / "inner")
    assert len(refused.value.detail) < 300


def test_a_mistake_is_said_with_the_file_s_name_and_line(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("study: own\nlearner:\n  epsilon: 7\n")
    with pytest.raises(InvalidStudy, match=r"^own.yaml:3: learner.epsilon: '7' does not do"):
        study_named("own", tmp_path)


def test_a_mistake_in_one_file_is_nobody_else_s(tmp_path: Path) -> None:
    (tmp_path / "aaa.yaml").write_text("{{{")
    (tmp_path / "own.yaml").write_text("study: own\n")
    assert study_named("own", tmp_path)["study"] == "own"


def test_bytes_that_are_no_text_are_a_mistake_and_no_crash(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_bytes(b"\xff\xfe\x00study")
    with pytest.raises(InvalidStudy, match=r"own.yaml"):
        study_named("own", tmp_path)
