"""What the viewers take of a schema, walked by the rules of their parsers."""

from __future__ import annotations

import json
from typing import Any

import pytest
from pydantic import BaseModel
from shift_recording.mcap.schemas import known_names, recorded_json, schema_of, subject_schemas
from shift_schemas.messages import Fact, Seen
from shift_schemas.registry import FACTS, SUBJECTS
from shift_study.study import Study
from support.recordings import decision_fact, gaze_fact, marker_fact

STUDY = Study(study="coffee", tasks=["grasp", "turn"])
STATES = ("engaged_observer", "high/focused/unknown")
SCHEMAS = {s: json.loads(data) for s, data in subject_schemas(STUDY, STATES).items()}
NUMBERS = ("number", "integer")


def foxglove_definitions(schema: dict[str, Any], name: str) -> dict[str, list[str]]:
    """Return field names by type, by the rules of Foxglove's parseJsonSchema, which throws where this asserts."""
    assert schema["type"] == "object", name
    found: dict[str, list[str]] = {name: list(schema["properties"])}
    for key, field in schema["properties"].items():
        assert "oneOf" not in field
        kind = field["type"]
        assert kind in ("boolean", "string", "object", "array", *NUMBERS), f"{name}.{key}: {kind!r}"
        assert "contentEncoding" not in field
        inner = field["items"] if kind == "array" else field
        assert inner["type"] in ("boolean", "string", "object", *NUMBERS) or kind != "array", f"{name}.{key}"
        if inner["type"] == "object":
            found |= foxglove_definitions(inner, f"{name}.{key}")
    return found


def nodes(node: Any) -> Any:
    """Yield every object and list within a schema."""
    yield node
    for child in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from nodes(child)


def matches(value: Any, schema: dict[str, Any], at: str = "") -> None:
    """Return whether a value is valid; this handles only the few keywords that the schemas have."""
    kinds: dict[str, Any] = {
        "object": dict,
        "array": list,
        "string": str,
        "boolean": bool,
        "integer": int,
        "number": (int, float),
    }
    assert isinstance(value, kinds[schema["type"]]), at
    assert "enum" not in schema or value in schema["enum"], at
    if schema["type"] == "array":
        for item in value:
            matches(item, schema["items"], at)
    elif schema["type"] == "object":
        assert set(schema.get("required", ())) <= set(value), at
        for key, inner in value.items():
            matches(inner, schema["properties"].get(key) or schema["additionalProperties"], f"{at}.{key}")


@pytest.mark.parametrize("subject", SUBJECTS)
def test_foxglove_parses_the_schema_of_every_subject(subject: str) -> None:
    assert foxglove_definitions(SCHEMAS[subject], subject)[subject] == list(FACTS[subject].model_fields)


@pytest.mark.parametrize("subject", SUBJECTS)
def test_a_schema_without_a_study_parses_as_well(subject: str) -> None:
    foxglove_definitions(schema_of(subject, {}), subject)


@pytest.mark.parametrize("subject", SUBJECTS)
def test_no_schema_has_references_unions_tuples_nulls_or_nested_arrays(subject: str) -> None:
    refused = {"$ref", "$defs", "anyOf", "oneOf", "allOf", "prefixItems", "patternProperties", "default"}
    for node in nodes(SCHEMAS[subject]):
        if isinstance(node, dict) and "type" in node and not isinstance(node["type"], dict):
            assert not refused & set(node)
            assert node["type"] != "null"
            assert isinstance(node["type"], str)
            assert node["type"] != "array" or node["items"]["type"] != "array"
            assert node["type"] != "object" or "properties" in node


@pytest.mark.parametrize("subject", SUBJECTS)
def test_every_description_is_kept(subject: str) -> None:
    described = {n: f.description for n, f in FACTS[subject].model_fields.items() if f.description}
    properties = SCHEMAS[subject]["properties"]
    assert {n: properties[n]["description"] for n in described} == described


@pytest.mark.parametrize(
    ("subject", "path", "names"),
    [
        ("observation", "gaze.weights", ["left", "middle", "right"]),
        ("observation", "awareness", ["grasp", "turn"]),
        ("decision", "scores", ["negation", "hesitation"]),
        ("decision", "strategy", ["negation", "hesitation"]),
        ("policy", "states", list(STATES)),
        ("session", "counts", list(SUBJECTS)),
    ],
)
def test_maps_list_the_names_that_the_study_gives(subject: str, path: str, names: list[str]) -> None:
    node = SCHEMAS[subject]
    for part in path.split("."):
        node = node["properties"][part]
    assert list(node["properties"]) == names
    assert all(value == node["additionalProperties"] for value in node["properties"].values())


def test_known_names_stand_where_maps_are() -> None:
    maps: set[str] = set()
    for subject in SUBJECTS:
        walk(SCHEMAS[subject], subject, maps)
    assert set(known_names(STUDY, STATES)) <= maps


def walk(node: dict[str, Any], at: str, maps: set[str]) -> None:
    """Collect the paths of maps."""
    if "additionalProperties" in node:
        maps.add(at)
    elif node["type"] == "array":
        walk(node["items"], at, maps)
    for key, inner in node.get("properties", {}).items():
        walk(inner, f"{at}.{key}", maps)


@pytest.mark.parametrize("fact", [gaze_fact(1), decision_fact(1, 0.5), decision_fact(2), marker_fact(1)])
def test_a_recorded_fact_is_what_its_schema_says(fact: Fact) -> None:
    matches(json.loads(recorded_json(fact)), SCHEMAS[fact.subject])


def test_a_field_without_a_value_is_left_out_and_not_required() -> None:
    assert "propensity" not in json.loads(recorded_json(decision_fact(2)))
    assert "propensity" not in SCHEMAS["decision"]["required"]
    assert SCHEMAS["decision"]["properties"]["propensity"]["type"] == "number"


def test_what_can_be_none_within_a_field_is_none_where_it_was_left_out() -> None:
    def nested(kind: type[BaseModel]) -> set[type[BaseModel]]:
        return {
            m
            for f in kind.model_fields.values()
            for m in (f.annotation, *getattr(f.annotation, "__args__", ()))
            if isinstance(m, type) and issubclass(m, BaseModel)
        }

    for kind in FACTS.values():
        for part in nested(kind) | {Seen}:
            optional = [f for f in part.model_fields.values() if type(None) in getattr(f.annotation, "__args__", ())]
            assert all(f.default is None for f in optional)
