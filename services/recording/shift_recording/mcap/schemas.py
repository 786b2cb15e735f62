"""The recording's JSON schemas, one per subject, and a fact as it stands in a recording.

Pure. Foxglove and Lichtblick parse a schema into flat definitions and refuse the whole topic where it
has ``$ref``, ``anyOf``, tuples, nested arrays, unions or an object without ``properties`` (their
``parseJsonSchema``, which knows no ``additionalProperties``). So everything is inlined; of a map the
names that the study gives are listed, with ``additionalProperties`` for the rest. PlotJuggler reads the
messages themselves and takes whatever is valid JSON.
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
"""Names that a map is known to have, by where it stands: ``observation.gaze.weights``."""

_KEPT = ("type", "description", "enum")


def subject_schemas(study: Study | None = None, policy_states: Sequence[str] = ()) -> dict[str, bytes]:
    """The ``jsonschema`` data of every subject, by subject.

    Parameters
    ----------
    study
        Names AOIs, strategies and tasks; left out, maps list no names.
    policy_states
        The rows of the first policy, once there is one.
    """
    names = known_names(study, policy_states)
    return {subject: json.dumps(schema_of(subject, names)).encode() for subject in SUBJECTS}


def schema_name(subject: str) -> str:
    """``shift.Decision.v1``."""
    return f"shift.{FACTS[subject].__name__}.{VERSION}"


def known_names(study: Study | None, policy_states: Sequence[str] = ()) -> dict[str, Sequence[str]]:
    """Which names each map is known to have."""
    names: dict[str, Sequence[str]] = {"session.counts": SUBJECTS, "policy.states": policy_states}
    if study is not None:
        strategies = tuple(study.scoring.strategies)
        names |= {"observation.gaze.weights": study.aoi_names, "observation.awareness": study.tasks or ()}
        names |= dict.fromkeys(_STRATEGY_MAPS, strategies)
    return names


_STRATEGY_MAPS = (
    "estimate.scores", "estimate.suggested", "decision.strategy", "decision.scores", "decision.suggested",
    "decision.actions", "override.strategy", "transition.action", "policy.actions",
)  # fmt: skip
"""Maps with one entry per strategy; an array's items stand where the array does."""


def schema_of(subject: str, names: Names) -> Schema:
    """The schema of one subject: inlined, and without what the viewers refuse.

    A field that may be ``None`` has the type that it has otherwise and is not required, since
    :func:`recorded_json` leaves it out; every other field is always written, hence required.
    """
    whole = _published_schema(subject)
    flat = _flat(whole, whole.get("$defs", {}), subject, names)
    return {"title": schema_name(subject), **flat}


@cache
def _published_schema(subject: str) -> Schema:
    """Return the JSON schema of a subject's message; it is the same for every session."""
    return FACTS[subject].model_json_schema()


def recorded_json(fact: Fact) -> bytes:
    """The fact as it stands in a recording: without its ``None`` fields."""
    return fact.model_dump_json(exclude_none=True).encode()


def _flat(node: Schema, definitions: Schema, at: str, names: Names) -> Schema:
    """``node`` with references and ``X | None`` resolved; ``at`` is where it stands."""
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
    """The schema that ``node`` stands for; its own description goes before that of the type."""
    if _may_be_none(node):
        (inner,) = (option for option in node["anyOf"] if option.get("type") != "null")
    elif "$ref" in node:
        inner = definitions[node["$ref"].rsplit("/", 1)[-1]]
    else:
        return node
    rest = {key: value for key, value in node.items() if key not in ("anyOf", "$ref")}
    return _resolved({**inner, **rest}, definitions)


def _value_in(node: Schema) -> Schema:
    """What the values of a map are; pydantic puts it under the keys' pattern where keys are ids."""
    by_pattern: dict[str, Schema] = node.get("patternProperties", {})
    (value,) = by_pattern.values() or (node["additionalProperties"],)
    return value


def _may_be_none(node: Schema) -> bool:
    return any(option.get("type") == "null" for option in node.get("anyOf", ()))
