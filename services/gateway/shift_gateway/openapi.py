"""The bodies in the OpenAPI document. Pure.

A path reads its body itself, after ids and session, so FastAPI does not know the body's model.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel
from shift_schemas.messages import Command


def documented_body(kind: type[BaseModel], media_types: Iterable[str] = ("application/json",)) -> dict[str, Any]:
    """Return the part of an operation that describes its body, each schema written out in its place."""
    schema = kind.model_json_schema(ref_template="#/components/schemas/{model}")
    whole = {"schema": _inlined(schema, schema.pop("$defs", {}))}
    return {"requestBody": {"required": True, "content": dict.fromkeys(media_types, whole)}}


def documented_query(kind: type[Command]) -> dict[str, Any]:
    """Return the part of an operation that describes the fields which the address may have."""
    described = kind.model_json_schema()["properties"]
    parameters = [
        {"name": name, "in": "query", "required": False, "schema": described[name]}
        for name in sorted(kind.query_fields)
    ]
    return {"parameters": parameters} if parameters else {}


def _inlined(node: Any, definitions: dict[str, Any]) -> Any:
    if isinstance(node, dict):
        if "$ref" in node:
            return _inlined(definitions[node["$ref"].rsplit("/", 1)[1]], definitions)
        return {k: _inlined(v, definitions) for k, v in node.items()}
    if isinstance(node, list):
        return [_inlined(v, definitions) for v in node]
    return node
