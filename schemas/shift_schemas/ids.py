"""Ids: one rule, checked in one place, for keys, file names and URLs. Pure.

Zenoh accepts ``**`` or ``a/b`` in a key, and would take such an id for a wildcard or another key.
"""

from __future__ import annotations

import re
import unicodedata
from typing import Annotated

from pydantic import StringConstraints

ID_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,62}$"
ID_RULE = "1 to 63 letters, digits, - and _, beginning with a letter or digit"
ID_LENGTH = 63
ID_EXAMPLE = "P01"
"""The proposal for a text of which nothing can be kept."""
_ID = re.compile(ID_PATTERN[1:-1])
_SAID = 40
"""How many characters of a refused text a sentence repeats."""
_LETTERS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "ẞ": "SS", "æ": "ae", "Æ": "Ae",
     "ø": "oe", "Ø": "Oe", "œ": "oe", "Œ": "Oe", "å": "aa", "Å": "Aa", "ł": "l", "Ł": "L", "đ": "d", "Đ": "D",
     "þ": "th", "Þ": "Th", "ð": "d", "ı": "i"}
)  # fmt: skip

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
"""A participant, session, task, AOI, source or ``..._id``. Pydantic's ``$`` matches only the very end of the text."""


def is_id(text: object) -> bool:
    """Return whether ``text`` is an id."""
    # ``$`` would also match before a newline at the end
    return isinstance(text, str) and _ID.fullmatch(text) is not None


def propose_id(text: str) -> str:
    """Return an id that reads like ``text``: ``P 01`` gives ``P-01``, ``Müller`` gives ``Mueller``.

    Umlauts and accents are transliterated, digits of other scripts become 0 to 9, everything else becomes a hyphen, and
    the result is cut to 63 characters. An id is returned as it is. If nothing can be kept, the result is ``P01``.
    """
    if is_id(text):
        return text
    composed = unicodedata.normalize("NFC", text[: 4 * ID_LENGTH]).translate(_LETTERS)
    kept = "".join(_plain(c) for c in unicodedata.normalize("NFKD", composed))
    hyphenated = re.sub(r"-*[^A-Za-z0-9_-][^A-Za-z0-9_]*", "-", kept)
    return hyphenated.lstrip("-_")[:ID_LENGTH].rstrip("-") or ID_EXAMPLE


def not_an_id(text: str) -> str:
    """Return the sentence for a ``text`` that is not an id: the text, the rule and a proposal."""
    said = text if len(text) <= _SAID else text[: _SAID - 1] + "…"
    return f"{said!r} is not an id: {ID_RULE}; for example {propose_id(text)}"


def _plain(character: str) -> str:
    if character.isascii():
        return character
    if unicodedata.category(character) in ("Mn", "Cf"):  # accents, and characters without a width
        return ""
    digit = unicodedata.decimal(character, None)
    return " " if digit is None else str(digit)
