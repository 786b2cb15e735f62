"""Studies by name: files of the data folder replace built-in studies, and a name is never a path."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_runtime.study_files import BUILT_IN, LARGEST_BYTES, find_study, list_studies, study_to_start
from shift_schemas.errors import InvalidStudy
from shift_study.loading import study_data, study_of
from shift_study.study import Study


def started(name: str, folder: Path) -> Study:
    """Return the study that a start with this name would have."""
    return study_of(study_to_start(name, folder).data)


def refusal(name: str, folder: Path) -> str:
    """Return the refusal of a start with this name."""
    with pytest.raises(InvalidStudy) as refused:
        study_to_start(name, folder)
    assert len(refused.value.detail) < 600
    return refused.value.detail


def test_built_in_studies_are_coffee_in_two_languages_and_default(tmp_path: Path) -> None:
    coffee, default = started("coffee", tmp_path), started("default", tmp_path)
    assert coffee.tasks == ["grasp", "turn", "pour"]
    assert list(coffee.conditions) == ["control", "adaptive"]
    assert started("coffee_de", tmp_path).tasks == coffee.tasks
    assert default.tasks is None
    assert default.aoi_names == ("left", "middle", "right")


def test_default_study_has_every_default(tmp_path: Path) -> None:
    plain, default = study_data(Study(study="default")), study_to_start("default", tmp_path).data
    assert default == plain | {"title": default["title"]}


def test_without_a_folder_only_built_in_studies_exist(tmp_path: Path) -> None:
    assert started("coffee", tmp_path / "nowhere").study == "coffee"


@pytest.mark.parametrize("suffix", [".yaml", ".yml", ".YAML", ".Yml", ".json", ".JSON"])
def test_file_of_the_folder_replaces_a_built_in_study(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"own{suffix}").write_text('{"study": "own", "interactions": 7}')
    (tmp_path / f"coffee{suffix}").write_text('{"study": "coffee", "interactions": 8}')
    assert started("own", tmp_path).interactions == 7
    assert started("coffee", tmp_path).interactions == 8


def test_json_file_may_be_indented_with_tabs(tmp_path: Path) -> None:
    data = {"study": "own", "title": "Küche 🍵 a: b, 'c'", "tasks": ["1", "on"], "reward": {"decay": 0.2}}
    (tmp_path / "own.json").write_text(json.dumps(data, indent="\t"))
    own = started("own", tmp_path)
    assert (own.title, own.tasks, own.reward.decay) == (data["title"], ["1", "on"], 0.2)


def test_unknown_name_is_refused_with_the_known_names_and_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("study: own\n")
    (tmp_path / "notes.txt").write_text("study: notes\n")
    with pytest.raises(InvalidStudy, match="coffee, coffee_de, default, own; did you mean 'coffee'") as refused:
        study_to_start("cofee", tmp_path)
    assert [(e.field, e.value) for e in refused.value.errors] == [("study", "cofee")]
    assert refusal("notes", tmp_path).endswith("there are coffee, coffee_de, default, own")


@pytest.mark.parametrize(
    "name", ["../own", "**", "own.yaml", "", "own\0", "own\n", "/etc/passwd", "x" * 65536], ids=lambda n: ascii(n)[:20]
)
def test_name_that_is_not_an_id_is_refused_without_a_search(tmp_path: Path, name: str) -> None:
    (tmp_path / "own.yaml").write_text("study: own\n")
    assert "name is an id" in refusal(name, tmp_path / "inner")


def test_mistake_names_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("study: own\nlearner:\n  epsilon: 7\n")
    assert refusal("own", tmp_path).startswith("own.yaml:3: learner.epsilon: '7' is not valid: it must be at most 1")


def test_mistake_in_one_file_does_not_affect_others(tmp_path: Path) -> None:
    (tmp_path / "aaa.yaml").write_text("{{{")
    (tmp_path / "own.yaml").write_text("study: own\n")
    assert started("own", tmp_path).study == "own"


def test_two_files_of_one_name_are_refused_and_both_are_named(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("study: own\ninteractions: 7\n")
    (tmp_path / "own.json").write_text('{"study": "own"}')
    assert "own.json and own.yaml have the same name; keep one of them" in refusal("own", tmp_path)


def test_area_that_no_gaze_can_hit_is_refused_at_a_start(tmp_path: Path) -> None:
    crossed = {"name": "cup", "polygon": [[0.2, 0.2], [0.8, 0.8], [0.8, 0.2], [0.2, 0.8]]}
    study = {"study": "own", "aois": [crossed]}
    (tmp_path / "own.yaml").write_text(json.dumps(study))
    assert refusal("own", tmp_path).startswith("own.yaml:1: aois.0.polygon: cup crosses itself")
    with pytest.raises(InvalidStudy, match=r"^study: aois.0.polygon: cup crosses itself") as refused:
        study_to_start(study, tmp_path)
    assert [(e.field, e.value) for e in refused.value.errors] == [("aois.0.polygon", "cup")]


# --- encodings ---


@pytest.mark.parametrize(
    ("raw", "says"),
    [("study: own\ntitle: Küche räumen\n".encode("latin-1"), "own.yaml:2: the file is not UTF-8 (byte 0xfc); in La"),
     ("study: own\ntitle: Küche räumen\n".encode("latin-1"), "the line would be 'title: Küche räumen'; save the fi"),
     ("study: own\n".encode("utf-16"), "own.yaml: the file is UTF-16; save it as UTF-8"),
     ("study: own\n".encode("utf-16-be"), "own.yaml: the file is UTF-16 or binary, since it contains zero bytes"),
     ("study: own\n".encode("utf-32"), "own.yaml: the file is UTF-32; save it as UTF-8"),
     (b"study: own\ntitle: \xff\xfe", "own.yaml:2: the file is not UTF-8 (byte 0xff)"),
     (b"study: own\n# " + b"x" * LARGEST_BYTES, "own.yaml has 256 KB; a study has at most 256 KB")],
    ids=["latin-1", "latin-1-text", "utf-16", "utf-16-be", "utf-32", "binary", "large"],
)  # fmt: skip
def test_file_that_is_not_utf_8_is_refused_with_what_to_do(tmp_path: Path, raw: bytes, says: str) -> None:
    (tmp_path / "own.yaml").write_bytes(raw)
    assert says in refusal("own", tmp_path)


@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"], ids=["plain", "bom"])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"], ids=["unix", "windows", "mac"])
def test_byte_order_mark_and_line_ends_have_no_effect(tmp_path: Path, bom: bytes, newline: bytes) -> None:
    lines = ["study: own", "title: Küche", "tasks:", "  - grasp", "  - turn", ""]
    (tmp_path / "own.yaml").write_bytes(bom + newline.join(line.encode() for line in lines))
    own = started("own", tmp_path)
    assert (own.study, own.title, own.tasks) == ("own", "Küche", ["grasp", "turn"])


# --- lists ---


def test_every_study_is_listed_with_title_place_mistakes_and_warnings(tmp_path: Path) -> None:
    (tmp_path / "far.yaml").write_text("study: far\ntitle: Far away\nfixation: {distance_cm: 650}\n")
    (tmp_path / "bad.yml").write_text("study: bad\nlearner: {epsilon: 2}\n")
    (tmp_path / "my study.yaml").write_text("study: mine\n")
    found = {study.name: study for study in list_studies(tmp_path)}
    assert list(found) == ["bad", "coffee", "coffee_de", "default", "far", "my study"]
    assert (found["coffee"].title, found["coffee"].place) == ("Making coffee with a robot", BUILT_IN)
    assert found["coffee"].mistakes == found["coffee"].warnings == found["default"].warnings == ()
    assert (found["far"].title, found["far"].place) == ("Far away", str(tmp_path / "far.yaml"))
    assert len(found["far"].warnings) == 1
    assert "if 650 mm are meant, write 65" in found["far"].warnings[0]
    assert found["bad"].study is None
    assert found["bad"].mistakes[0].startswith("bad.yml:2: learner.epsilon: '2' is not valid")
    assert "'my study' is not an id" in found["my study"].mistakes[0]
    assert "rename it to my-study.yaml" in found["my study"].mistakes[0]


def test_study_with_another_name_than_its_file_gets_a_warning_with_both_names(tmp_path: Path) -> None:
    (tmp_path / "pilot.yaml").write_text("study: coffee\n")
    _, warnings = study_to_start("pilot", tmp_path)
    assert len(warnings) == 1
    assert "started with 'pilot', the file's name, and recorded under 'coffee', its study" in warnings[0]
    assert "write study: pilot, or rename the file to coffee.yaml" in warnings[0]
    assert find_study("pilot", tmp_path) is not None
    assert find_study("pilo", tmp_path) is None


def test_study_object_at_a_start_gets_warnings(tmp_path: Path) -> None:
    assert study_to_start({"study": "x"}, tmp_path).warnings == ()
    assert len(study_to_start({"study": "x", "fixation": {"distance_cm": 650}}, tmp_path).warnings) == 1
