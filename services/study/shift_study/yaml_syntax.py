"""YAML text to nodes, and sentences for errors of its syntax. Pure."""

from __future__ import annotations

import json
import re

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import Node
from shift_schemas.errors import shorten

from shift_study.mistakes import Mistake, refusal

DEEPEST = 32
"""Levels of nesting; a study has seven."""


def compose(text: str, name: str) -> Node | None:
    """Return the root node of ``text``, or None for an empty file; ``name`` is the file's.

    Raises :class:`InvalidStudy` if the text is not YAML.
    """
    yaml = YAML(typ="safe", pure=True)
    yaml.max_depth = 2 * DEEPEST
    yaml.composer.warn_double_anchors = False
    try:
        found: Node | None = yaml.compose(_without_tabs(text))
    except (YAMLError, RecursionError, ValueError) as e:
        raise refusal(name, [Mistake(_line_of(e, text), "", "", _syntax_rule(e))]) from e
    return found


def _without_tabs(text: str) -> str:
    """Return JSON with spaces for tabs: JSON may be indented with tabs, YAML may not."""
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
"""The parser's problem as a pattern, and the sentence for it."""


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
