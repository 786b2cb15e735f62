"""Writes the tables of docs/study.md from the study's own models: ``python docs/make_study_reference.py``."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shift_study.constants import (
    AttentionSettings,
    AwarenessSettings,
    CapacitySettings,
    DeciderSettings,
    FixationSettings,
    RewardSettings,
)
from shift_study.learner_settings import LearnerSettings
from shift_study.phrases import PhrasesSettings, TaskPhrases
from shift_study.scoring_table import StrategySettings

PAGE = Path(__file__).with_name("study.md")
BEGIN, END = "<!-- tables: made by docs/make_study_reference.py -->", "<!-- end of tables -->"
PARTS = {
    "capacity": CapacitySettings,
    "attention": AttentionSettings,
    "fixation": FixationSettings,
    "awareness": AwarenessSettings,
    "reward": RewardSettings,
    "scoring.strategies.NAME": StrategySettings,
    "decider": DeciderSettings,
    "learner": LearnerSettings,
    "phrases": PhrasesSettings,
    "phrases.tasks.NAME": TaskPhrases,
}


def tables() -> str:
    """The tables, one per part of the study."""
    lines: list[str] = []
    for name, model in PARTS.items():
        summary = (model.__doc__ or "").strip().splitlines()[0]
        lines += [
            f"### `{name}`",
            "",
            summary,
            "",
            "| key | default | range | meaning and source |",
            "|---|---|---|---|",
        ]
        lines += list(_rows(model.model_json_schema()))
        lines.append("")
    return "\n".join(lines)


def _rows(schema: dict[str, Any]) -> Iterator[str]:
    for key, field in schema["properties"].items():
        default = f"`{json.dumps(field['default'])}`" if "default" in field else "to be given"
        yield f"| `{key}` | {default} | {_range(field)} | {field.get('description', '')} |"


def _range(field: dict[str, Any]) -> str:
    if "enum" in field:
        return ", ".join(f"`{v}`" for v in field["enum"])
    low = f"> {field['exclusiveMinimum']:g}" if "exclusiveMinimum" in field else ""
    low = low or (f">= {field['minimum']:g}" if "minimum" in field else "")
    high = f"<= {field['maximum']:g}" if "maximum" in field else ""
    return " and ".join(part for part in (low, high) if part) or str(field.get("const", field.get("type", "")))


def with_tables(page: str) -> str:
    """The page with its tables made anew."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n\n{tables()}{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
