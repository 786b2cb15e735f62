"""The JSON schemas of a recording, one per subject, and the JSON form of a recorded fact.

Pure. Foxglove and Lichtblick parse a schema into flat definitions. They refuse a whole topic whose schema has
``$ref``, ``anyOf``, tuples, nested arrays, unions or an object without ``properties`` (their ``parseJsonSchema``
does not know ``additionalProperties``). So everything is inlined, and a map lists the names that the study gives,
with ``additionalProperties`` for the rest. PlotJuggler reads the messages themselves and accepts any valid JSON.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from shift_schemas.codec import VERSION
from shift_schemas.messages import Fact
from shift_schemas.registry import FACTS, SUBJECTS
from shift_study.study import Study

Schema = dict[str, Any]
Names = Mapping[str, Sequence[str]]
"""The known names of a map, by its path: ``observation.gaze.weights``."""

_KEPT = ("type", "description", "enum")


def subject_schemas(study: Study | None = None, policy_states: Sequence[str] = ()) -> dict[str, bytes]:
    """Return the ``jsonschema`` data of every subject.

    Parameters
    ----------
    study
        Gives the names of AOIs, strategies and tasks; without it, maps list no names.
    policy_states
        The rows of the first policy, if there is a policy already.
    """
    names = known_names(study, policy_states)
    return {subject: json.dumps(schema_of(subject, names)).encode() for subject in SUBJECTS}


def schema_name(subject: str) -> str:
    """Return the name of a schema, such as ``shift.Decision.v1``."""
    return f"shift.{FACTS[subject].__name__}.{VERSION}"


def known_names(study: Study | None, policy_states: Sequence[str] = ()) -> dict[str, Sequence[str]]:
    """Return the known names of each map."""
    names: dict[str, Sequence[str]] = {
        "session.counts": SUBJECTS, "policy.states": policy_states, "clock.refused": ("malformed", "conflict"),
    }  # fmt: skip
    if study is not None:
        strategies = tuple(study.scoring.strategies)
        names |= {"observation.gaze.weights": study.aoi_names, "observation.awareness": study.tasks or ()}
        names |= dict.fromkeys(_STRATEGY_MAPS, strategies)
    return names


_STRATEGY_MAPS = (
    "estimate.scores", "estimate.suggested", "decision.strategy", "decision.scores", "decision.suggested",
    "decision.actions", "override.strategy", "transition.action", "policy.actions",
)  # fmt: skip
"""The paths of maps with one entry per strategy; the items of an array have the path of the array."""


def schema_of(subject: str, names: Names) -> Schema:
    """Return the schema of one subject, inlined, and without what the viewers refuse.

    A field that may be ``None`` has its other type and is not required, because :func:`recorded_json` leaves
    ``None`` out. Every other field is always written and is therefore required.
    """
    whole = _published_schema(subject)
    flat = _flat(whole, whole.get("$defs", {}), subject, names)
    return {"title": schema_name(subject), **flat}


@cache
def _published_schema(subject: str) -> Schema:
    """Return the JSON schema of a subject's message; it is the same for every session."""
    return FACTS[subject].model_json_schema()


def recorded_json(fact: Fact) -> bytes:
    """Return the JSON of a recorded fact, without its ``None`` fields."""
    return fact.model_dump_json(exclude_none=True).encode()


def _flat(node: Schema, definitions: Schema, at: str, names: Names) -> Schema:
    """Return ``node`` with references and ``X | None`` resolved; ``at`` is its path."""
    node = _resolved(node, definitions)
    flat = {key: node[key] for key in _KEPT if key in node}
    match node["type"]:
        case "object" if "properties" in node:
            fields = node["properties"]
            flat["properties"] = {n: _flat(f, definitions, f"{at}.{n}", names) for n, f in fields.items()}
            flat["required"] = [n for n, f in fields.items() if not _may_be_none(f)]
        case "object":
            value = _flat(_value_in(node), definitions, f"{at}.*", names)
            flat["properties"] = dict.fromkeys(names.get(at, ()), value)
            flat["additionalProperties"] = value
        case "array":
            flat["items"] = _flat(node["items"], definitions, at, names)
    return flat


def _resolved(node: Schema, definitions: Schema) -> Schema:
    """Return the schema to which ``node`` refers; the node's description replaces that of the type."""
    if _may_be_none(node):
        (inner,) = (option for option in node["anyOf"] if option.get("type") != "null")
    elif "$ref" in node:
        inner = definitions[node["$ref"].rsplit("/", 1)[-1]]
    else:
        return node
    rest = {key: value for key, value in node.items() if key not in ("anyOf", "$ref")}
    return _resolved({**inner, **rest}, definitions)


def _value_in(node: Schema) -> Schema:
    """Return the schema of a map's values; pydantic puts it under the pattern of the keys if the keys are ids."""
    by_pattern: dict[str, Schema] = node.get("patternProperties", {})
    (value,) = by_pattern.values() or (node["additionalProperties"],)
    return value


def _may_be_none(node: Schema) -> bool:
    return any(option.get("type") == "null" for option in node.get("anyOf", ()))
