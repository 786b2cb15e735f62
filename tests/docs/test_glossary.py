"""The glossary has a line for each message that travels."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from shift_model import vocabulary
from shift_schemas.registry import COMMANDS, FACTS, OWNER_OF, PROCEDURE_OWNER

GLOSSARY = Path(__file__).resolve().parents[2] / "docs" / "glossary.md"


def rows() -> list[list[str]]:
    """Return the cells of every table row of the glossary."""
    lines = GLOSSARY.read_text(encoding="utf-8").splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]


@pytest.mark.parametrize("subject", sorted(FACTS))
def test_every_fact_stands_in_the_glossary_with_its_owner(subject: str) -> None:
    owners = [row[1] for row in rows() if row[0] == f"`{subject}`"]
    assert OWNER_OF[subject] in owners


@pytest.mark.parametrize("procedure", sorted(COMMANDS))
def test_every_command_stands_in_the_glossary_with_its_owner(procedure: str) -> None:
    owners = [row[1] for row in rows() if row[0] == f"`{procedure}`"]
    assert PROCEDURE_OWNER[procedure] in owners


def test_no_term_is_explained_twice_in_the_same_table() -> None:
    tables = GLOSSARY.read_text(encoding="utf-8").split("\n\n")
    for table in tables:
        terms = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("|")]
        assert len(terms) == len(set(terms)), terms


WORDS = (
    *vocabulary.CAPACITIES, *vocabulary.GAZES, *vocabulary.AWARENESSES, *vocabulary.COGNITIVE_STATES.values(),
    *get_args(vocabulary.PolicySource), *get_args(vocabulary.LearnerName),
)  # fmt: skip


@pytest.mark.parametrize("word", sorted(set(WORDS)))
def test_every_word_on_the_wire_stands_in_the_glossary(word: str) -> None:
    assert f"`{word}`" in GLOSSARY.read_text(encoding="utf-8")
