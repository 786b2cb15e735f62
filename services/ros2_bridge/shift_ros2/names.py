"""ROS names: what a name, namespace or node may be called, relative names, remap rules. Pure."""

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
    """``old:=new``."""

    old: str
    new: str


def check_node(name: str) -> str:
    """``name``, or :class:`InvalidSettings` that says what a node may be called."""
    if len(name) > LONGEST_NAME or not _NODE.fullmatch(name):
        raise InvalidSettings(f"node {shorten(name)!r}: {NAME_RULE}, without /")
    return name


def check_namespace(namespace: str) -> str:
    """``namespace`` with its leading slash, or :class:`InvalidSettings`."""
    full = namespace if namespace.startswith("/") else f"/{namespace}"
    if len(full) > LONGEST_NAME or not _NAMESPACE.fullmatch(full):
        raise InvalidSettings(f"namespace {shorten(namespace)!r}: {NAME_RULE}")
    return full


def expanded(name: str, namespace: str, node: str) -> str:
    """The full name: ``gaze`` is in the namespace, ``~/gaze`` under the node, ``/gaze`` as it is.

    Raises :class:`InvalidSettings` for what is no ROS name; wildcards are none.
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
    """The full name after the first remap rule that fits."""
    full = expanded(name, namespace, node)
    for rule in remaps:
        if expanded(rule.old, namespace, node) == full:
            return expanded(rule.new, namespace, node)
    return full
