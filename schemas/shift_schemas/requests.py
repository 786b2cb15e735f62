"""The bodies of requests, derived from the commands: one set for REST and ROS 2. Pure.

A body has the command's own fields in their order, without those that services fill in. The path names the session.
The command id is optional and has a name of its own (``decision_id``); a repeat with the same id gets the first result.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from pydantic import BaseModel, create_model
from pydantic.fields import FieldInfo

from shift_schemas.ids import Id
from shift_schemas.messages import Command, Mark, Message, PatchBody, PerformanceBody, StartSession

__all__ = ["MarkerBody", "PatchBody", "PerformanceBody", "StartBody", "body_type"]

ID_DESCRIPTION = "Your id for it; a repeat gets the first result."


@cache
def body_type(kind: type[Command]) -> type[BaseModel]:
    """Return the model of the body with which a client asks for a command."""
    if kind.body is not None:
        return kind.body
    fields: dict[str, Any] = {}
    for name in kind.body_fields():
        info = kind.model_fields[name]
        fields[name] = _optional_id(info.description) if name == kind.id_field else (info.annotation, info)
    if kind.id_field:
        fields.setdefault(kind.id_field, _optional_id(ID_DESCRIPTION))
    return create_model(f"{kind.__name__}Body", __base__=Message, __doc__=kind.__doc__, **fields)


def _optional_id(description: str | None) -> tuple[Any, FieldInfo]:
    return Id | None, FieldInfo(default=None, description=description)


StartBody: Any = body_type(StartSession)
MarkerBody: Any = body_type(Mark)
