"""Links: an owner that answers by the router only has lost its link; one that answers nobody is left alone."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from shift_runtime.links import REOPEN_PAUSE_S, SILENT_S, Links

pytestmark = pytest.mark.anyio


@dataclass
class Around:
    """A bus whose owners answer as the test decides, and a clock that the test sets."""

    now: float = 100.0
    by_router: set[str] = field(default_factory=set)
    direct: set[str] = field(default_factory=set)
    lost: list[str] = field(default_factory=list)
    reopened: int = 0

    async def reopen(self) -> None:
        self.reopened += 1

    async def answers_by_router(self, key: str) -> bool:
        return any(f"/{owner}/" in key for owner in self.by_router)

    async def pull(self, owner: str) -> bool:
        return owner in self.direct


def begun() -> tuple[Around, Links]:
    around = Around()
    links = Links(around, ("recorder", "learner"), around.lost.append, lambda: around.now)  # type: ignore[arg-type]
    for owner in links.owners:
        links.answered(owner)
    return around, links


async def test_silent_owner_is_unreached_after_a_while_and_counted_once() -> None:
    around, links = begun()
    around.now += SILENT_S
    links.answered("learner")
    assert links.unreached == []
    around.now += 0.1
    for _ in range(3):
        await links.keep(around.pull)
    assert (links.unreached, around.lost, around.reopened) == (["recorder"], ["recorder"], 0)
    links.answered("recorder")
    assert links.unreached == []


async def test_bus_is_reopened_when_an_owner_answers_through_the_router_only() -> None:
    around, links = begun()
    around.now += SILENT_S + 1
    around.by_router = {"recorder"}
    await links.keep(around.pull)
    assert around.reopened == 1
    await links.keep(around.pull)
    assert around.reopened == 1, "a new session needs a moment to meet the others"
    around.now += REOPEN_PAUSE_S
    await links.keep(around.pull)
    assert around.reopened == 2


async def test_owner_that_answers_directly_again_needs_no_new_links() -> None:
    around, links = begun()
    around.now += SILENT_S + 1
    around.by_router = around.direct = {"recorder", "learner"}
    await links.keep(around.pull)
    assert around.reopened == 0


async def test_owner_that_never_answered_counts_as_starting() -> None:
    around = Around()
    links = Links(around, ("recorder",), around.lost.append, lambda: around.now)  # type: ignore[arg-type]
    around.now += 60
    await links.keep(around.pull)
    assert (links.unreached, around.lost) == ([], [])
