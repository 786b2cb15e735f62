"""The checks before a session, in a mesh of two shards: each shard's recorder is asked about its own sessions."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from shift_gateway.gateway import Gateway
from shift_gateway.settings import GatewaySettings
from shift_gateway.web.preflight import Preflight
from shift_runtime.bus.memory import MemoryBus
from shift_schemas.shards import shard_of
from support.gateway_mesh import Session, running_mesh, until_ready
from support.runtime_fixtures import until_asked

pytestmark = pytest.mark.anyio


async def said(gateway: Gateway, sentence: str) -> bool:
    """Return whether one of the checks says this."""
    return sentence in [check.sentence for check in await Preflight(gateway).checks()]


async def test_recorders_of_both_shards_have_read_everything(tmp_path: Path) -> None:
    names = sorted(("s1", "s2"), key=lambda name: shard_of(name, 2))
    assert [shard_of(name, 2) for name in names] == [0, 1]
    async with running_mesh(tmp_path / "0") as first, running_mesh(tmp_path / "1") as second:
        for mesh, name in zip((first, second), names, strict=True):
            await until_ready(mesh)
            await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "session": name})
            await Session(mesh, name).decide()
        gateway = Gateway(GatewaySettings(data=tmp_path))
        async with gateway.on([MemoryBus(first.hub), MemoryBus(second.hub)], first.clock):
            for name in names:
                await gateway.read_model.view(name)
            assert sorted(gateway.read_model.views) == sorted(names)
            await until_asked(partial(said, gateway, "The recorder has 0 messages to read."))


async def test_recorder_that_does_not_answer_is_not_said_to_have_read_everything(tmp_path: Path) -> None:
    async with running_mesh(tmp_path / "0") as mesh:
        await until_ready(mesh)
        await mesh.session()
        await mesh.stop("recorder")
        gateway = Gateway(GatewaySettings(data=tmp_path))
        async with gateway.on([MemoryBus(mesh.hub)], mesh.clock):
            assert await said(gateway, "It is not known how far the recorder has read.")
