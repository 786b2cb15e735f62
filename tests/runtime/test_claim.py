"""The claim: each owner exists once, and another mesh is told apart from an earlier process of the same one."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

import pytest
from shift_runtime import claim as module
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.claim import Claim, OwnedElsewhere, mesh_id
from shift_schemas.codec import encode
from shift_schemas.messages import Health
from shift_schemas.timestamps import Stamp

pytestmark = pytest.mark.anyio
KEY = "shift/v1/@service/monitor/health"


def monitor(hub: Hub, mesh: str, since_s: int) -> Claim:
    """Return the claim of a monitor that answers."""
    bus = MemoryBus(hub)
    health = Health(service="monitor", ready=True, mesh=mesh, since=Stamp(sec=since_s, nsec=0), data=f"/{mesh}")
    bus.serve(KEY, lambda request: request.reply(encode(health)))
    return Claim(bus, "monitor", mesh, Stamp(sec=since_s, nsec=0))


async def kept(claim: Claim) -> str:
    """Return the outcome of keeping a claim for a while: the refusal, the warning or nothing."""
    try:
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(claim.keep(), 0.2)
    except OwnedElsewhere as e:
        return e.detail
    return claim.conflict


async def test_claim_succeeds_when_nobody_answers() -> None:
    await Claim(MemoryBus(Hub()), "monitor", "a", Stamp(sec=1, nsec=0)).make()


async def test_other_mesh_is_refused_with_its_folder_and_the_remedy() -> None:
    hub = Hub()
    monitor(hub, "a", 1)
    with pytest.raises(OwnedElsewhere, match="another monitor answers on this router already, with the data folder /a"):
        await Claim(MemoryBus(hub), "monitor", "b", Stamp(sec=2, nsec=0)).make()


async def test_earlier_process_of_the_same_folder_is_the_same_mesh() -> None:
    hub = Hub()
    monitor(hub, "a", 1)
    await Claim(MemoryBus(hub), "monitor", "a", Stamp(sec=2, nsec=0)).make()


@pytest.mark.parametrize(("first_s", "second_s"), [(1, 2), (5, 5)])
async def test_later_of_two_meshes_yields_and_the_earlier_one_reports_it(
    monkeypatch: pytest.MonkeyPatch, first_s: int, second_s: int
) -> None:
    monkeypatch.setattr(module, "LOOK_AGAIN_S", (0.01,))
    hub = Hub()
    first, second = monitor(hub, "a", first_s), monitor(hub, "b", second_s)
    assert "with the data folder /b; stop it" in await kept(first)
    assert "another monitor answers on this router already" in await kept(second)


def test_folder_keeps_its_id(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    first = mesh_id(tmp_path)
    assert mesh_id(tmp_path) == first
    assert mesh_id(tmp_path / "other") != first
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["mesh-id"]
