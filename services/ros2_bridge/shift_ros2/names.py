"""ROS names: rules for names, namespaces and nodes, relative names, and remap rules. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from shift_schemas.errors import InvalidSettings, shorten

_TOKEN = r"[A-Za-z_][A-Za-z0-9_]*"
_NODE = re.compile(_TOKEN)
_NAMESPACE = re.compile(rf"/|(/{_TOKEN})+")
_NAME = re.compile(rf"(~|~/|/)?{_TOKEN}(/{_TOKEN})*")
NAME_RULE = "letters, digits and _, parts separated by /, none beginning with a digit"
LONGEST_NAME = 255


@dataclass(frozen=True)
class Remap:
    """One remap rule, ``old:=new``."""

    old: str
    new: str


def check_node(name: str) -> str:
    """Return ``name``. Raise :class:`InvalidSettings` if it is not valid for a node."""
    if len(name) > LONGEST_NAME or not _NODE.fullmatch(name):
        raise InvalidSettings(f"node {shorten(name)!r}: {NAME_RULE}, without /")
    return name


def check_namespace(namespace: str) -> str:
    """Return ``namespace`` with its leading slash. Raise :class:`InvalidSettings` if it is not valid."""
    full = namespace if namespace.startswith("/") else f"/{namespace}"
    if len(full) > LONGEST_NAME or not _NAMESPACE.fullmatch(full):
        raise InvalidSettings(f"namespace {shorten(namespace)!r}: {NAME_RULE}")
    return full


def expanded(name: str, namespace: str, node: str) -> str:
    """Return the full name: ``gaze`` is in the namespace, ``~/gaze`` below the node, ``/gaze`` is unchanged.

    Raises :class:`InvalidSettings` for a name that ROS does not allow; wildcards are not allowed.
    """
    if len(name) > LONGEST_NAME or not _NAME.fullmatch(name):
        raise InvalidSettings(f"name {shorten(name)!r}: {NAME_RULE}")
    if name.startswith("/"):
        return name
    base = namespace.rstrip("/")
    if name.startswith("~"):
        return f"{base}/{node}/{name.lstrip('~/')}"
    return f"{base}/{name}"


def resolved(name: str, namespace: str, node: str, remaps: Iterable[Remap]) -> str:
    """Return the full name after the first remap rule that matches."""
    full = expanded(name, namespace, node)
    for rule in remaps:
        if expanded(rule.old, namespace, node) == full:
            return expanded(rule.new, namespace, node)
    return full
