"""The refusal of a command whose id was used before with another content. Pure.

A command that is sent again gets its first result. The same id with another content is refused. The refusal names the
thing in the user's words, the differences with both values, and what to do.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

from shift_schemas.errors import Conflict, FieldError, shorten
from shift_schemas.messages import Command

SHOWN = 4
"""How many differences are named. Chosen so that the sentence stays readable."""
NAMES = frozenset({"session", "procedure", "command_id"})
"""Fields that say which command it is. They are equal in both."""


class Difference(NamedTuple):
    """One place where two contents differ. ``before`` and ``now`` are JSON values; None is a missing field."""

    field: str
    before: Any
    now: Any


def differences(before: str, now: str) -> list[Difference]:
    """Return where two contents (JSON objects, see :meth:`Command.content`) differ, by dotted field name.

    Another order of the fields is not a difference, and neither is 1 for 1.0.
    """
    return list(_differences("", json.loads(before), json.loads(now)))


def _differences(path: str, before: Any, now: Any) -> Iterator[Difference]:
    if isinstance(before, dict) and isinstance(now, dict):
        for name in {**before, **now}:
            if path or name not in NAMES:
                yield from _differences(f"{path}.{name}" if path else name, before.get(name), now.get(name))
    elif before != now or _is_flag(before) != _is_flag(now):
        yield Difference(path, before, now)


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool)  # in Python True == 1


def repeat_conflict(command: Command, before: str) -> Conflict:
    """Return the refusal of ``command``, whose id was used before with the content ``before``.

    Parameters
    ----------
    before
        The first command's content as JSON. If it is not known (a journal of version 0.1.0 has only a digest), the
        sentence names no values.
    """
    words = command.wording
    first = words.first.format(id=command.command_id, session=command.session, procedure=command.procedure)
    found = differences(before, command.content()) if before.startswith("{") else []
    if not found:
        return Conflict(f"{first}, with another content. {words.remedy}.")
    shown = found[:SHOWN]
    more = f" and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    then = " and ".join(_said(d.field, d.before) for d in shown) + more
    now = " and ".join(_said(d.field, d.now) for d in shown) + more
    return Conflict(f"{first}, with {then}; this {words.again} says {now}. {words.remedy}.", _errors(shown))


def _errors(found: list[Difference]) -> tuple[FieldError, ...]:
    return tuple(
        FieldError(
            field=shorten(d.field),
            value="" if d.now is None else _text(d.now),
            rule=f"it was {'left out' if d.before is None else _text(d.before)} the first time",
        )
        for d in found
    )


def _said(field: str, value: Any) -> str:
    name = shorten(field)
    return f"no {name}" if value is None else f"{name} {_text(value)}"


def _text(value: Any) -> str:
    """Return the value as a sentence shows it: an id as it is, text in quotes, anything else as JSON."""
    if isinstance(value, str) and value and " " not in value:
        return shorten(value)
    return shorten(json.dumps(value, ensure_ascii=False))
