"""A study's YAML as plain data: keys and ids as written, numbers and words as their place expects them. Pure.

``ruamel.yaml`` parses YAML 1.2 and gives the positions. The values are read here, because the meaning of ``on``, ``01``
or ``2024`` depends on the place: an id, a word or a text stays as written, and a number or a boolean follows the core
schema of YAML 1.2. Keys are always text. JSON is read in the same way.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from shift_schemas.errors import shorten

from shift_study.mistakes import Lines, Mistake, mistake_at, refusal
from shift_study.shape import CONDITIONS, Path, dotted, kind_at
from shift_study.yaml_numbers import core_value
from shift_study.yaml_syntax import DEEPEST, compose

LARGEST = 50_000
"""Entries of a study file, aliases counted each time: a few lines of YAML can expand to billions of entries."""
MERGE = "<<"
_TAGS = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float", "bool", "null", "map", "seq", "merge", "timestamp")
)
"""Tags without an effect: the place decides the type."""
_DIGITS = re.compile(r"[0-9]+")


def read_yaml(text: str, name: str) -> tuple[Any, Lines]:
    """Return the plain data that ``text`` spells, and the line of each path; ``name`` is the file's.

    Raises
    ------
    InvalidStudy
        The text is not YAML, a key is given twice, or it is too large; with one sentence per mistake.
    """
    node = compose(text.removeprefix("\ufeff"), name)
    if not isinstance(node, MappingNode):
        what = "the file is empty" if node is None else "this is a list or a text"
        raise refusal(name, [Mistake(1, "", "", f"a study is a mapping and {what}; begin with 'study: my-study'")])
    reading = _Reading()
    try:
        data = reading.value(node, ())
    except _TooMuch as e:
        raise refusal(name, [Mistake(None, "", "", str(e))]) from e
    if reading.mistakes:
        raise refusal(name, reading.mistakes)
    return data, reading.lines


class _TooMuch(ValueError):
    """The file holds more than a study can have."""


class _Reading:
    """One walk over the nodes. It collects every mistake, so that the error lists all of them."""

    def __init__(self) -> None:
        self.lines: Lines = {}
        self.mistakes: list[Mistake] = []
        self._entries = 0

    def value(self, node: Node, path: Path) -> Any:
        """Return the plain value of a node."""
        self._count(path)
        self.lines.setdefault(path, _line(node))
        if str(node.tag) not in _TAGS:
            self._mistake(node, path, f"the tag {shorten(str(node.tag))} is not taken; write plain text and numbers")
            return None
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            return [self.value(item, (*path, i)) for i, item in enumerate(node.value)]
        return self._scalar(node, path) if isinstance(node, ScalarNode) else None

    def _count(self, path: Path) -> None:
        self._entries += 1
        if len(path) > DEEPEST:
            raise _TooMuch(f"it is nested too deep, or an anchor contains itself; write at most {DEEPEST} levels")
        if self._entries > LARGEST:
            raise _TooMuch(f"it has more than {LARGEST} entries, aliases counted each time; write a smaller one")

    def _mapping(self, node: MappingNode, path: Path) -> dict[str, Any]:
        data: dict[str, Any] = {}
        own: dict[str, int] = {}
        for key, value, merged in self._pairs(node, path, 0):
            name = self._key(key, path)
            if name is None:
                continue
            here = (*path, name)
            if not merged and name in own:
                rule = f"it is given twice, first in line {own[name]} (quotes make no difference); keep one of the two"
                self._mistake(key, here, rule)
                continue
            if not merged:
                own[name] = _line(key)
            self.lines[here] = _line(key)
            data[name] = self.value(value, here)
        self._check_commas(node, path)
        return data

    def _pairs(self, node: MappingNode, path: Path, depth: int) -> Iterator[tuple[Node, Node, bool]]:
        """Yield keys, values and whether they are merged (``<<: *base``); merged ones come first and are overridden."""
        self._count(path)
        if depth > DEEPEST:
            raise _TooMuch("an anchor merges itself; write the values out")
        for key, value in node.value:
            if not _is_merge(key):
                continue
            sources = reversed(value.value) if isinstance(value, SequenceNode) else [value]
            for source in sources:
                if isinstance(source, MappingNode):
                    yield from ((k, v, True) for k, v, _ in self._pairs(source, path, depth + 1))
                else:
                    self._mistake(key, (*path, MERGE), "<< takes the alias of a mapping, as in <<: *base")
        yield from ((key, value, False) for key, value in node.value if not _is_merge(key))

    def _key(self, node: Node, path: Path) -> str | None:
        if isinstance(node, ScalarNode):
            return _joined(node.value)
        self._mistake(node, path, "a key is a word; write name: value")
        return None

    def _scalar(self, node: ScalarNode, path: Path) -> Any:
        text = _joined(node.value)
        if node.style is not None:
            return text
        if not text:
            return self._nothing(node, path)
        value, kind = core_value(text), kind_at(path)
        return text if kind == "text" and value is not None else value

    def _nothing(self, node: ScalarNode, path: Path) -> Any:
        """Read an empty entry: an empty part has its defaults; an empty value is a mistake."""
        in_condition = len(path) > 2 and path[0] == CONDITIONS
        strategy = path[:-1] == ("scoring", "strategies")
        kind = kind_at(path)
        if kind == "any":
            return None  # an unknown key is reported elsewhere
        if kind == "mapping" and isinstance(path[-1], str) and not in_condition and not strategy:
            return {}
        null = "; null removes it" if in_condition or strategy else ""
        rule = f"nothing is written here; write a value, or remove the key{null}"
        self.mistakes.append(mistake_at(self.lines.get(path, _line(node)), path, "", rule))
        return None

    def _check_commas(self, node: MappingNode, path: Path) -> None:
        """Find ``{epsilon: 0,75}``: the comma ends the entry, and 75 becomes a key."""
        if not node.flow_style:
            return
        for (key, value), (following, nothing) in zip(node.value, node.value[1:], strict=False):
            if not (_is_plain(value, _DIGITS) and _is_plain(following, _DIGITS) and _is_plain(nothing, re.compile(""))):
                continue
            self.mistakes = [m for m in self.mistakes if m.field != dotted((*path, following.value))]
            written = f"{value.value},{following.value}"
            rule = f"'{written}' is not valid: the comma ends the entry; write {written.replace(',', '.')} with a point"
            self.mistakes.append(mistake_at(_line(value), (*path, str(key.value)), written, rule))

    def _mistake(self, node: Node, path: Path, rule: str) -> None:
        value = node.value if isinstance(node, ScalarNode) else ""
        self.mistakes.append(mistake_at(_line(node), path, value, rule))


def _line(node: Node) -> int:
    return int(node.start_mark.line) + 1


def _is_plain(node: Node, pattern: re.Pattern[str]) -> bool:
    return isinstance(node, ScalarNode) and node.style is None and pattern.fullmatch(node.value) is not None


def _is_merge(key: Node) -> bool:
    return isinstance(key, ScalarNode) and key.style is None and key.value == MERGE


def _joined(text: str) -> str:
    """Return the text with surrogate pairs joined: JSON writes characters beyond the basic plane as pairs."""
    if not any("\ud800" <= c <= "\udfff" for c in text):
        return text
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
