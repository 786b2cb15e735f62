"""Command-line options for names of learners and users. The module imports nothing heavy, so that help is fast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, get_args

import typer
from shift_model.vocabulary import LearnerName
from shift_schemas.errors import shorten
from shift_schemas.suggestions import did_you_mean

LEARNER_NAMES: tuple[str, ...] = get_args(LearnerName)
LEARNER_HELP = f"Name of a learner: {', '.join(LEARNER_NAMES)}."
USER_HELP = "A simulated user: A, B, C or D of the paper, or the path of a user file (JSON)."
USER_METAVAR = "A|B|C|D|FILE"


def check_learner(value: Any) -> Any:
    """Return the option's value, a name or a list of names; refuse a name that is not a learner."""
    for name in value if isinstance(value, list) else [value] if value is not None else []:
        check_name(name, LEARNER_NAMES, "a learner")
    return value


def check_name(name: str, known: Sequence[str], what: str) -> None:
    """Raise :class:`typer.BadParameter` unless ``name`` is one of ``known``."""
    if name not in known:
        meant = did_you_mean(name, known)
        raise typer.BadParameter(f"{shorten(name)!r} is not {what}; write one of {', '.join(known)}{meant}")
