"""``--ros-args``: remaps, parameters and parameter files as ROS nodes take them. Pure; it only reads the files.

``--ros-args -r old:=new -p name:=value -r __ns:=/lab -r __node:=shift --params-file FILE --log-level LEVEL``,
ended by ``--`` or the end of the line. Words with ``:=`` outside of it are read as ROS 1 writes them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode
from shift_schemas.errors import InvalidSettings, shorten
from shift_study.yaml_numbers import core_value

from shift_ros2.names import Remap, check_namespace, check_node

Parameters = dict[str, str]
DEEPEST = 16
"""Levels of a parameter file: namespaces, node, ros__parameters, name."""
_SCHEMES = ("rostopic://", "rosservice://")
_IGNORED = {"--enable-rosout-logs", "--disable-rosout-logs", "--enable-stdout-logs", "--disable-stdout-logs",
            "--enable-external-lib-logs", "--disable-external-lib-logs"}  # fmt: skip
_IGNORED_WITH_VALUE = {"-e", "--enclave", "--log-config-file"}


@dataclass
class RosArguments:
    """The parts of a command line. ``rest`` has the words that are not for ROS."""

    node: str | None = None
    namespace: str | None = None
    remaps: list[Remap] = field(default_factory=list)
    parameters: Parameters = field(default_factory=dict)
    files: list[str] = field(default_factory=list)
    log_level: str | None = None
    rest: list[str] = field(default_factory=list)


def parse_ros_args(line: Sequence[str]) -> RosArguments:
    """Return the parts of a command line. Raise :class:`InvalidSettings`, which names the wrong word."""
    found = RosArguments()
    words = list(line)
    inside = False
    while words:
        word = words.pop(0)
        if word == "--ros-args":
            inside = True
        elif not inside and ":=" in word:
            _ros1(found, word)
        elif not inside:
            found.rest.append(word)
        elif word == "--":
            inside = False
        elif word in ("-r", "--remap"):
            _remap(found, _value(word, words))
        elif word in ("-p", "--param"):
            name, value = _pair(word, _value(word, words))
            found.parameters[name.rpartition(":")[2]] = _scalar(name, value)
        elif word == "--params-file":
            found.files.append(_value(word, words))
        elif word == "--log-level":
            found.log_level = _value(word, words).rpartition(":=")[2].lower()
        elif word in _IGNORED_WITH_VALUE:
            _value(word, words)
        elif word not in _IGNORED:
            raise InvalidSettings(
                f"--ros-args: {shorten(word)!r} is not known here; write one of -r, -p, --params-file, --log-level"
            )
    return found


def parameters_of(text: str, file: str, full_name: str, known: Callable[[str], bool]) -> Parameters:
    """Return the parameters for the node ``full_name`` in a parameter file.

    A section for every node (``/**``) may have parameters of others; one for this node may not.
    """
    try:
        data = _as_written(_composed(text), 0)
    except YAMLError as e:
        raise InvalidSettings(f"{file}: this is not YAML: {shorten(str(e))}") from e
    if not isinstance(data, dict):
        raise InvalidSettings(f"{file}: a parameter file maps node names to ros__parameters")
    found: Parameters = {}
    for pattern, parameters in _sections(data, ""):
        if not _matches(pattern, full_name):
            continue
        if not isinstance(parameters, dict):
            raise InvalidSettings(f"{file}: {pattern}: ros__parameters maps names to values")
        for name, value in parameters.items():
            if "*" not in pattern and not known(name):
                raise InvalidSettings(f"{file}: {pattern}: {shorten(name)!r} is not a parameter of the bridge")
            if known(name) and value is not None:
                found[name] = _scalar(name, value)
    return found


def _composed(text: str) -> Node | None:
    yaml = YAML(typ="safe", pure=True)
    yaml.max_depth = 4 * DEEPEST
    node: Node | None = yaml.compose(text)
    return node


def _as_written(node: Node | None, depth: int) -> Any:
    """Return the node's data with each value as written: a session ``010`` or ``no`` is a name."""
    if node is None or depth > DEEPEST:
        return None
    if isinstance(node, ScalarNode):
        return node.value if node.style is not None or core_value(node.value) is not None else None
    if isinstance(node, MappingNode):
        return {str(key.value): _as_written(value, depth + 1) for key, value in node.value}
    return [_as_written(item, depth + 1) for item in node.value]


def _sections(data: dict[Any, Any], above: str) -> list[tuple[str, Any]]:
    found = []
    for key, value in data.items():
        path = f"{above}/{str(key).strip('/')}"
        if isinstance(value, dict):
            if "ros__parameters" in value:
                found.append((path, value["ros__parameters"]))
            else:
                found += _sections(value, path)
    return found


def _matches(pattern: str, full_name: str) -> bool:
    parts = ["(/[^/]+)*" if p == "**" else "/[^/]+" if p == "*" else "/" + re.escape(p) for p in pattern.split("/")[1:]]
    return re.fullmatch("".join(parts), full_name) is not None


def _value(word: str, words: list[str]) -> str:
    if not words:
        raise InvalidSettings(f"--ros-args: {word} needs a value")
    return words.pop(0)


def _pair(word: str, text: str) -> tuple[str, str]:
    left, sign, right = text.partition(":=")
    if not sign or not left or not right:
        raise InvalidSettings(f"--ros-args: {word} {shorten(text)!r}: write {word} name:=value")
    return left, right


def _remap(found: RosArguments, text: str) -> None:
    left, right = _pair("-r", text)
    left = re.sub(r"^[A-Za-z_][A-Za-z0-9_]*:(?!//)", "", left)  # for one node only: this process has one
    if left in ("__ns", "__namespace"):
        found.namespace = check_namespace(right)
    elif left in ("__node", "__name"):
        found.node = check_node(right)
    else:
        for scheme in _SCHEMES:
            left, right = left.removeprefix(scheme), right.removeprefix(scheme)
        found.remaps.append(Remap(left, right))


def _ros1(found: RosArguments, word: str) -> None:
    """Take a word as ROS 1 and its roslaunch write it: ``__name:=x``, ``_parameter:=value`` or ``old:=new``."""
    left, _, right = word.partition(":=")
    if not left or not right:
        raise InvalidSettings(f"{shorten(word)!r}: write name:=value")
    if left in ("__name", "__ns"):
        _remap(found, word)
    elif left == "__master":
        found.parameters["master"] = right
    elif left.startswith("__"):
        pass  # __log, __ip and __hostname: rospy reads them itself
    elif left.startswith("_"):
        found.parameters[left[1:]] = _scalar(left, right)
    else:
        _remap(found, word)


def _scalar(name: str, value: Any) -> str:
    """Return the value as text for the settings, with quotes read as in YAML."""
    if isinstance(value, str) and value[:1] in ("'", '"'):
        try:
            value = _as_written(_composed(value), 0)
        except YAMLError as e:
            raise InvalidSettings(f"parameter {shorten(name)}: {shorten(value)!r} is not YAML") from e
    if isinstance(value, (dict, list)):
        raise InvalidSettings(f"parameter {shorten(name)}: one value, not {shorten(value)}")
    return str(value)
