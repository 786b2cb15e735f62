"""The compose file: each service's health check asks for a service that the check knows. No container is started."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from shift_runtime.healthcheck import CHECKED

COMPOSE = YAML(typ="safe").load((Path(__file__).parents[2] / "docker-compose.yml").read_text())
SERVICES: dict[str, Any] = COMPOSE["services"]


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_health_check_asks_for_a_service_that_it_knows(name: str) -> None:
    command = SERVICES[name]["healthcheck"]["test"]
    assert command[:4] == ["CMD", "python", "-m", "shift_runtime.healthcheck"]
    assert command[4] in CHECKED


def test_every_service_of_the_mesh_is_there() -> None:
    assert set(SERVICES) >= {"router", "recorder", "monitor", "decider", "learner", "gateway"}
