"""The study file's JSON Schema, for editors that complete and check a file during writing. Pure.

``docs/study.schema.json`` is made from it: ``python -m shift_study.json_schema > docs/study.schema.json``.
It checks single values as the parser does; only the parser checks how values fit together.
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
    """Return the schema of a study file: only ``study`` is required, and unknown keys are refused.

    It differs from the model's schema in what the parser adds: missing parts of the scoring system have their
    defaults, a strategy set to null is removed, and a condition consists of parts of a study.
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
        name: {**strategy, "description": f"Left out: {', '.join(default['levels'])}; null removes it."}
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
    """Return the text of the schema file."""
    return json.dumps(study_json_schema(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())
