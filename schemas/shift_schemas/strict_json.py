"""Strict JSON: no infinite numbers, no repeated keys, no unlimited nesting, all of which Python accepts. Pure."""

from __future__ import annotations

import json
from math import isfinite
from typing import Any

from shift_schemas.errors import FieldError, MalformedMessage


class NotJson(MalformedMessage):
    """Text that is not JSON at all; the gateway explains it further."""


def parse_json(raw: bytes | str) -> Any:
    """Return the value of ``raw``. Raise :class:`MalformedMessage` with the rule that it breaks."""
    try:
        return json.loads(raw, object_pairs_hook=_once, parse_constant=_no_constant, parse_float=_finite)
    except (ValueError, RecursionError) as e:
        kind, rule = (MalformedMessage, str(e)) if isinstance(e, _Refused) else (NotJson, "the body must be JSON")
        raise kind(f"body: {rule}", (FieldError(field="body", value="", rule=rule),)) from e


class _Refused(ValueError):
    pass


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise _Refused("a key is given twice")
    return found


def _finite(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise _Refused("a number must be finite")
    return number


def _no_constant(name: str) -> Any:
    raise _Refused(f"{name} is not a number in JSON")
