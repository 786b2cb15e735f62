"""A study's YAML as plain data: keys and ids as written, each number and word as its place expects it. Pure.

``ruamel.yaml`` parses (YAML 1.2) and gives positions; the values are read here, because what ``on``, ``01`` or
``2024`` stands for depends on the place. Where the study has an id, a word or a text, it stays as written. Where it
has a number or a boolean, the core schema of YAML 1.2 counts. Keys are always text. JSON is read in the same way.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.representer import SafeRepresenter
from shift_schemas.errors import shorten

from shift_study.mistakes import Lines, Mistake, mistake_at, refusal
from shift_study.shape import CONDITIONS, Path, dotted, kind_at
from shift_study.yaml_numbers import core_value

LARGEST = 50_000
"""Entries of a study file, aliases counted each time: a few lines of YAML can spell billions of them."""
DEEPEST = 32
"""Levels of nesting; a study has seven."""
MERGE = "<<"
_TAGS = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float", "bool", "null", "map", "seq", "merge", "timestamp")
)
"""Tags that repeat what the place says already."""
_DIGITS = re.compile(r"[0-9]+")


def read_yaml(text: str, name: str) -> tuple[Any, Lines]:
    """Return the plain data that ``text`` spells, and the line of each path; ``name`` is the file's.

    Raises
    ------
    InvalidStudy
        The text is not YAML, a key is given twice, or it is too large; with one sentence per mistake.
    """
    node = _composed(text.removeprefix("\ufeff"), name)
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
    """The file spells more than a study can be."""


class _Reading:
    """One walk over the nodes. What is wrong is collected, so that every mistake is said at once."""

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
        """Keys and values, those of merged mappings (``<<: *base``) first; what stands here overrides them."""
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
        """Read what was left empty: a part with nothing below it has its defaults; a value must be written."""
        in_condition = len(path) > 2 and path[0] == CONDITIONS
        strategy = path[:-1] == ("scoring", "strategies")
        kind = kind_at(path)
        if kind == "any":
            return None  # an unknown key: that is said
        if kind == "mapping" and isinstance(path[-1], str) and not in_condition and not strategy:
            return {}
        null = "; null takes it out again" if in_condition or strategy else ""
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
    """The text with surrogate pairs joined, as JSON writes characters beyond the basic plane."""
    if not any("\ud800" <= c <= "\udfff" for c in text):
        return text
    return text.encode("utf-16", "surrogatepass").decode("utf-16", "replace")


# --- syntax ---


def _composed(text: str, name: str) -> Node | None:
    yaml = YAML(typ="safe", pure=True)
    yaml.max_depth = 2 * DEEPEST
    yaml.composer.warn_double_anchors = False
    try:
        found: Node | None = yaml.compose(_without_tabs(text))
    except (YAMLError, RecursionError, ValueError) as e:
        raise refusal(name, [Mistake(_line_of(e, text), "", "", _syntax_rule(e))]) from e
    return found


def _without_tabs(text: str) -> str:
    """JSON may be indented with tabs, YAML not. A string of JSON cannot hold a raw tab."""
    if "\t" not in text or not text.lstrip().startswith("{"):
        return text
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return text
    return text.replace("\t", " ")


def _line_of(error: Exception, text: str) -> int | None:
    mark = getattr(error, "problem_mark", None)
    if mark is not None:
        return int(mark.line) + 1
    position = getattr(error, "position", None)
    return text.count("\n", 0, position) + 1 if isinstance(position, int) else None


_RULES = tuple(
    (re.compile(problem), sentence)
    for problem, sentence in (
        (r"found character '\\t'", "a tab stands where YAML takes spaces only; write spaces, two for each level"),
        ("found character '(.)'", "a value cannot begin with {0}; put it into quotes"),
        (
            "mapping values are not allowed",
            "': ' stands where no key can, or the line is indented too far; put a value that contains ': ' into quotes",
        ),
        ("undefined alias '(.*)'", "*{0} names no anchor; write &{0} at the value that it repeats"),
        ("expected ',' or '(.)'.*stream end", "the bracket that opens in line {line} is not closed; write {0}"),
        ("end of stream", "the quotation mark that opens in line {line} is not closed"),
        (
            "expected <block end>",
            "the line does not fit into what begins in line {line}; begin entries that belong together in one column",
        ),
        ("special characters are not allowed", "it has a character that no text has; save it again as text in UTF-8"),
    )
)
"""What the parser complains of, and the sentence for it."""


def _syntax_rule(error: Exception) -> str:
    if isinstance(error, RecursionError) or type(error).__name__ == "MaxDepthExceededError":
        return "this is not YAML: it is nested too deep"
    problem = getattr(error, "problem", None) or getattr(error, "reason", None) or str(error)
    if "found another document" in problem:
        return "--- begins a second study; a file holds one, so put the other into a file of its own"
    begun = getattr(error, "context_mark", None)
    for pattern, sentence in _RULES:
        if found := pattern.search(problem):
            line = int(begun.line) + 1 if begun is not None else "?"
            return f"this is not YAML: {sentence.format(*found.groups(), line=line)}"
    return f"this is not YAML: {shorten(problem)}"


# --- writing ---


class _Readable(SafeRepresenter):
    """Writes short rows and lists of plain values in one line, and everything else line by line."""

    def represent_mapping(self, tag: Any, mapping: Any, flow_style: Any = None) -> Any:
        """Choose the style by what is in the mapping."""
        items = dict(mapping)
        short = len(items) <= 3 and not any(isinstance(value, (dict, list)) for value in items.values())
        return super().represent_mapping(tag, items, flow_style=short)


def write_yaml(data: Any) -> str:
    """Return plain data as a study file; :func:`read_yaml` takes it back."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _Readable
    yaml.default_flow_style = None  # lists of plain values stand in one line
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # the order of strategies counts
    yaml.width = 110
    text = StringIO()
    yaml.dump(data, text)
    return text.getvalue()
