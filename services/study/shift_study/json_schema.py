"""The study file's JSON Schema, for editors that complete and check while one writes. Pure.

``docs/study.schema.json`` is made from it: ``python -m shift_study.json_schema > docs/study.schema.json``.
It says of a single value what the parser says; what must fit together only the parser knows.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from shift_study.scoring_table import DEFAULT_STRATEGIES
from shift_study.study import CONDITIONAL, Study

Schema = dict[str, Any]
TITLE = "A study of the SHIFT mesh"


def study_json_schema() -> Schema:
    """The schema of a study file: everything but ``study`` may be left out, nothing unknown is taken.

    It differs from the model's own in what the parser fills in: parts of the scoring system that are left out
    are the default's, a strategy set to null is taken out, and a condition is made of parts of a study.
    """
    schema = Study.model_json_schema()
    parts = schema["$defs"]
    for part in parts.values():
        if part["title"] != "Aoi":
            part.pop("required", None)
    strategies = parts["ScoringSettings"]["properties"]["strategies"]
    strategy = _or_null({"$ref": "#/$defs/StrategySettings"})
    (name_of_strategy,) = strategies.pop("patternProperties")
    strategies.pop("minProperties", None)
    strategies["propertyNames"] = {"pattern": name_of_strategy}
    strategies["additionalProperties"] = strategy
    strategies["properties"] = {
        name: {**strategy, "description": f"Left out: {', '.join(default['levels'])}; null takes it out."}
        for name, default in DEFAULT_STRATEGIES.items()
    }
    fields = schema["properties"]
    condition = {name: _or_null(field) for name, field in fields.items() if name in CONDITIONAL}
    fields["conditions"] = {
        "description": fields["conditions"]["description"],
        "type": "object",
        "propertyNames": {"pattern": fields["study"]["pattern"]},
        "additionalProperties": {"type": "object", "properties": condition, "additionalProperties": False},
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": TITLE}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


def schema_text() -> str:
    """The schema as the file holds it."""
    return json.dumps(study_json_schema(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())
