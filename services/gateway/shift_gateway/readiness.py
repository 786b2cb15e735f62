"""The readiness of the mesh: of each service, and of each pair of a reader and the owner that it reads. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shift_schemas.messages import Health

SILENT = "does not answer"


def readiness(answers: Mapping[str, Health | None], gateway: Health) -> dict[str, Any]:
    """Return the answer of ``/readyz``.

    ``missing`` names the services at fault. A service is not at fault if it only does not reach another one that
    answers nobody; ``links`` still names each such pair.
    """
    silent = {service for service, health in answers.items() if health is None}
    every: dict[str, Health | None] = {**answers, gateway.service: gateway}
    services = {service: _condition(health, silent) for service, health in every.items()}
    missing = [service for service, condition in services.items() if condition != "ready"]
    links = [
        f"the {health.service} does not reach the {owner}"
        for health in every.values()
        if health is not None
        for owner in health.unreached
    ]
    folders = {service: health.data for service, health in answers.items() if health is not None and health.data}
    return {
        "ready": not missing and not links, "missing": missing, "services": services, "links": links, "data": folders,
    }  # fmt: skip


def _condition(health: Health | None, silent: set[str]) -> str:
    if health is None:
        return SILENT
    only_others = health.unreached and set(health.unreached) <= silent and "does not reach" in health.detail
    return "ready" if health.ready or only_others else health.detail or "not ready"
