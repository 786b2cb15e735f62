"""docs/interface.md lists every path, command, option, fact, procedure and kind of error that exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from shift_cli.entry import command_line, commands
from shift_cli.main import app as cli
from shift_gateway.app import make_app
from shift_gateway.settings import GatewaySettings
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import ManualClock
from shift_schemas.registry import COMMANDS, FACTS, OWNER_OF

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "interface.md").read_text(encoding="utf-8")


def paths() -> list[str]:
    """Return each method and path of the gateway's OpenAPI document."""

    async def open_buses() -> list[Bus]:
        return [MemoryBus(Hub())]

    document = make_app(GatewaySettings(), open_buses, ManualClock(0)).openapi()
    return [f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods]


COMMAND_LINES = {" ".join(words): command for words, command in commands(command_line(cli))}


@pytest.mark.parametrize("path", paths())
def test_every_path_is_listed(path: str) -> None:
    path = path.replace("/strategy", "/strategy?task=T")
    assert f"`{path}`" in PAGE


@pytest.mark.parametrize("words", COMMAND_LINES)
def test_every_command_is_listed_with_its_options(words: str) -> None:
    row = re.search(rf"^\| `shift-mesh {words}(?: [A-Z]+)?` \| (.*) \|$", PAGE, re.MULTILINE)
    assert row is not None
    options = [name for option in COMMAND_LINES[words].params for name in option.opts if name.startswith("--")]
    assert [name for name in options if f"`{name}`" not in row[1] and name != "--help"] == []


@pytest.mark.parametrize("subject", FACTS)
def test_every_fact_is_listed_with_its_owner_and_its_own_fields(subject: str) -> None:
    row = re.search(rf"^\| `{subject}` \| {OWNER_OF[subject]} \| (.*) \|$", PAGE, re.MULTILINE)
    assert row is not None
    assert [name for name in FACTS[subject].model_fields if not re.search(rf"\b{name}\b", PAGE)] == []


@pytest.mark.parametrize("procedure", COMMANDS)
def test_every_procedure_is_listed(procedure: str) -> None:
    assert f"`{procedure}`" in PAGE
