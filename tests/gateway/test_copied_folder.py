"""A data folder that was copied while a mesh used it: the error names the journals that do not fit together."""

from __future__ import annotations

import shutil

import pytest
from support.gateway_mesh import Mesh

pytestmark = pytest.mark.anyio


async def test_journals_that_do_not_fit_together_are_named_and_the_session_does_not_end(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.decide()
    state = mesh.data / "state"
    await mesh.stop("decider")
    shutil.copy(state / "decider.sqlite", mesh.data / "older.sqlite")
    mesh.start("decider")
    await session.decide()
    await session.read("policy")
    await mesh.stop("decider")
    for file in state.glob("decider.sqlite*"):
        file.unlink()
    shutil.copy(mesh.data / "older.sqlite", state / "decider.sqlite")
    mesh.start("decider")
    ended = await session.post("end", {})
    assert ended.status_code == 409
    assert "messages of the decider, whose journal ends at" in ended.json()["detail"]
    assert "copied while a mesh used it" in ended.json()["detail"]
    ready = await mesh.http.get("/readyz")
    assert ready.status_code == 503
    assert any("the decider's journal ends at message" in said for said in ready.json()["services"].values())
