"""A learner's prior that stands in a file beside the study: ``learner: {prior: wizard.json}``. Pure.

``shift-mesh whatif --out`` writes such a file where a person overrode SHIFT. The table takes the place of the name when
the study is read, so that the study that is recorded holds all of it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from shift_study.mistakes import Lines, Mistake, mistake_at
from shift_study.shape import CONDITIONS, Path

ReadBeside = Callable[[str], str]
"""Returns the text of a file beside the study file; raises OSError or ValueError if there is none."""

FORMAT = 1
"""The format of the file, in its field ``format``."""


def read_prior_files(data: Any, lines: Lines, read: ReadBeside) -> list[Mistake]:
    """Put the tables of prior files into the plain data of a study; return the mistakes."""
    found = []
    for path, settings in _learners(data):
        name = settings.get("prior")
        if isinstance(name, str):
            try:
                settings["prior"] = _table(read(name))
            except (OSError, ValueError) as e:
                why = e.strerror if isinstance(e, OSError) else e
                rule = f"the prior file {name} beside the study cannot be used: {why}"
                where = (*path, "prior")
                found.append(mistake_at(lines.get(where), where, name, rule))
    return found


def _learners(data: Any) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the settings of the study's learner and of each condition's, with their paths."""
    parts: list[tuple[Path, Any]] = [((), data)]
    conditions = data.get(CONDITIONS) if isinstance(data, dict) else None
    if isinstance(conditions, dict):
        parts += [((CONDITIONS, name), part) for name, part in conditions.items()]
    for path, part in parts:
        settings = part.get("learner") if isinstance(part, dict) else None
        if isinstance(settings, dict):
            yield (*path, "learner"), settings


def _table(text: str) -> Any:
    data = json.loads(text)
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("states"), dict):
        raise ValueError(f"it is not a policy table of format {FORMAT}, as shift-mesh whatif --out writes it")
    return data["states"]
