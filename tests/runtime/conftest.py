"""Fixtures of the runtime: a Zenoh router, and buses of both kinds."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterator

import pytest
import zenoh
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus
from shift_runtime.bus.zenoh import ZenohBus
from shift_runtime.bus.zenoh_config import zenoh_config
from support.runtime_fixtures import free_endpoint

OpenBus = Callable[[], Awaitable[Bus]]


@pytest.fixture
def anyio_backend() -> str:
    """The services run on asyncio."""
    return "asyncio"


@pytest.fixture(scope="session")
def router() -> Iterator[str]:
    """Start a Zenoh router in this process and return its endpoint."""
    endpoint = free_endpoint()
    session = zenoh.open(zenoh_config("router", listen=endpoint))
    yield endpoint
    session.close()


@pytest.fixture(params=["memory", "zenoh"])
async def open_bus(request: pytest.FixtureRequest) -> AsyncIterator[OpenBus]:
    """Return a function that opens buses of one mesh; they are closed after the test."""
    buses: list[Bus] = []
    hub = Hub()

    async def memory() -> Bus:
        buses.append(MemoryBus(hub))
        return buses[-1]

    async def over_zenoh() -> Bus:
        buses.append(await ZenohBus.open(request.getfixturevalue("router"), "tcp/127.0.0.1:0"))
        return buses[-1]

    if request.param == "zenoh":
        request.getfixturevalue("router")
    yield memory if request.param == "memory" else over_zenoh
    for bus in buses:
        await bus.close()
