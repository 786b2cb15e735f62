"""The study file's JSON Schema, for editors: current, and of one mind with the parser."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML
from shift_schemas.errors import InvalidStudy
from shift_study.json_schema import schema_text, study_json_schema
from shift_study.loading import parse_study, study_data
from shift_study.study import Study
from support.study_texts import CONTRACT, OUT_OF_RANGE, PACE, written

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "study.schema.json"
STUDIES = ROOT / "schemas" / "shift_schemas" / "studies"
SCHEMA = study_json_schema()
KNOWN_TO_THE_PARSER_ONLY = {
    ("capacity.demanding", "['shouting']"), ("tasks", "['a', 'a']"), ("interactions", "1.0"),
    ("scoring.strategies.negation.levels", "['a', 'a', 'b']"), ("scoring.strategies.negation.thresholds", "[0.5]"),
    ("scoring.strategies.negation.thresholds", "[0.9, 0.1]"),
}  # fmt: skip
"""How parts fit together."""


def mistakes(text: str) -> list[str]:
    """What the schema finds in a study file."""
    found = jsonschema.Draft202012Validator(SCHEMA).iter_errors(YAML(typ="safe", pure=True).load(text))
    return [error.message for error in found]


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


def test_the_file_is_current() -> None:
    remake = "make it anew: .venv/bin/python -m shift_study.json_schema > docs/study.schema.json"
    assert FILE.read_text() == schema_text(), remake


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.yaml")), ids=lambda p: p.name)
def test_the_built_in_studies_follow_it(path: Path) -> None:
    assert mistakes(path.read_text()) == []
    assert parse_study(path.read_text()).study == path.stem


def test_the_example_names_it_where_it_lies() -> None:
    named = re.search(r"yaml-language-server: \$schema=(\S+)", (STUDIES / "coffee.yaml").read_text())
    assert named is not None
    assert (STUDIES / named[1]).resolve() == FILE


@pytest.mark.parametrize(
    "text",
    ["study: x", CONTRACT, PACE, "study: x\nscoring: {strategies: {hesitation: null, negation: {weight: 2}}}",
     "study: x\nconditions: {a: {scoring: {strategies: {hesitation: null}}, learner: null}, b: {}}",
     "study: x\nscoring: {table: {gaze: {focused: {negation: 1}}}}"],
)  # fmt: skip
def test_what_the_parser_takes_it_takes(text: str) -> None:
    parse_study(text)
    assert mistakes(text) == []


def test_it_takes_every_default_written_out() -> None:
    assert mistakes(json.dumps(study_data(Study(study="x")))) == []


@pytest.mark.parametrize(
    ("path", "value"), [c for c in OUT_OF_RANGE if (c[0], str(c[1])) not in KNOWN_TO_THE_PARSER_ONLY], ids=str
)
def test_what_is_out_of_range_it_refuses(path: str, value: object) -> None:
    assert mistakes(written(path, value)[0])


@pytest.mark.parametrize(
    "text",
    ["title: no name", "study: x\nzzz: 1", "study: x\nreward: {zzz: 1}", "study: x\nconditions: {a: {tasks: [x]}}",
     "study: x\nconditions: {a: {reward: {decay: -1}}}", "study: x\nconditions: {a/b: {}}"],
)  # fmt: skip
def test_what_the_parser_refuses_it_refuses(text: str) -> None:
    with pytest.raises(InvalidStudy):
        parse_study(text)
    assert mistakes(text)


def properties(node: Any) -> list[tuple[str, Any]]:
    """Every property of the schema, of conditions once."""
    if isinstance(node, list):
        return [p for inner in node for p in properties(inner)]
    if not isinstance(node, dict):
        return []
    own = list(node.get("properties", {}).items()) if isinstance(node.get("properties"), dict) else []
    return own + [p for inner in node.values() for p in properties(inner)]


def test_every_value_is_described() -> None:
    bare = {
        name for name, field in properties(SCHEMA)
        if "description" not in field and "$ref" not in field and "anyOf" not in field and name not in ROWS
    }  # fmt: skip
    assert bare == set()


ROWS = {
    "low", "high", "distracted", "uncertain", "focused", "unknown", "failure", "misconception_enabledness",
    "misconception_comprehension", "success",
}  # fmt: skip
"""Categories; what a row is, the table says."""
