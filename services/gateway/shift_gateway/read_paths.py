"""The paths that only read: sessions, configuration, observation, policy, and a preview of the next decision."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import FastAPI, Query
from shift_schemas.errors import check_id

from shift_gateway.gateway import Gateway
from shift_gateway.problems import only


def add_reads(app: FastAPI, gateway: Gateway) -> None:
    """Add the paths."""

    @app.get("/v1/sessions", tags=["sessions"])
    async def list_sessions() -> dict[str, Any]:
        """Return every session."""
        return {"sessions": await gateway.api.sessions()}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    async def get_session(session: str) -> dict[str, Any]:
        """Return one session, with counts so far."""
        return await gateway.api.session(check_id("session", session))

    @app.get("/v1/sessions/{session}/config", tags=["configuration"])
    async def get_config(session: str) -> dict[str, Any]:
        """Return the study in force."""
        return await gateway.api.config(check_id("session", session))

    @app.get("/v1/sessions/{session}/observation", tags=["reading"])
    async def get_observation(session: str) -> dict[str, Any]:
        """Return the partner model."""
        return await gateway.api.observation(check_id("session", session))

    @app.get("/v1/sessions/{session}/policy", tags=["reading"])
    async def get_policy(session: str) -> dict[str, Any]:
        """Return the policy for the next decision."""
        return await gateway.api.policy(check_id("session", session))

    @app.get("/v1/sessions/{session}/strategy", tags=["reading"])
    async def preview(
        session: str,
        task: Annotated[list[str], Query(description="The task.")] = [],  # noqa: B006 - FastAPI copies it
    ) -> dict[str, Any]:
        """Return what a decision made now would carry; no side effect."""
        check_id("session", session)
        return await gateway.api.preview(session, check_id("task", only("task", task)))
