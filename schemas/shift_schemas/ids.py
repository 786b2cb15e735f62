"""Ids: one rule, checked in one place, for keys, file names and URLs alike.

Zenoh would accept ``**`` or ``a/b`` as an id and make a wildcard or another key of it.
"""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import StringConstraints

ID_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,62}$"
ID_RULE = "1 to 63 letters, digits, - and _, beginning with a letter or digit"
_ID = re.compile(ID_PATTERN[1:-1])

Id = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
"""A participant, session, task, AOI, source or ``..._id``. Pydantic's ``$`` is the very end, before no newline."""


def is_id(text: object) -> bool:
    """Whether ``text`` is an id. ``fullmatch``, so that a trailing newline does not slip through."""
    return isinstance(text, str) and _ID.fullmatch(text) is not None
