"""Convergence: a session's end waits until every service has read everything."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import pytest
from shift_recorder.service import convergence as module
from shift_recorder.service.convergence import Convergence
from shift_schemas.errors import Conflict, Unavailable
from shift_schemas.messages import OutboxPage
from shift_schemas.registry import OWNERS, READS

pytestmark = pytest.mark.anyio
HEADS = {"recorder": 3, "monitor": 20, "decider": 7, "learner": 5}


@dataclass
class Services:
    """The pages of four services, and how far the recorder has processed them."""

    heads: dict[str, int] = field(default_factory=lambda: dict(HEADS))
    silent: tuple[str, ...] = ()
    asked: int = 0
    at_question: Callable[[int], None] = lambda n: None

    def __post_init__(self) -> None:
        self.processed = {("s1", owner): head for owner, head in self.heads.items()}
        self.cursors = {peer: {o: HEADS[o] for o in READS[peer]} for peer in module.PEERS}
        self.pages: dict[str, OutboxPage] = {}

    async def pull_all(self, owners: Iterable[str], session: str) -> tuple[str, ...]:
        self.asked += 1
        self.at_question(self.asked)
        for owner in owners:
            read = {session: dict(self.cursors.get(owner, {}))}
            self.pages[f"{owner}/{session}"] = OutboxPage(
                owner=owner, rows=[], heads={session: self.heads[owner]}, cursors=read, complete=True
            )
        return self.silent


def converging(services: Any) -> Convergence:
    return Convergence(services, services)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "END_WAIT_S", 0.05)
    monkeypatch.setattr(module, "ASK_AGAIN_S", 0.001)


async def test_services_that_have_read_everything_have_converged() -> None:
    services = Services()
    await converging(services).reach("s1")
    assert services.asked == 1


@pytest.mark.parametrize("peer", module.PEERS)
async def test_service_that_lags_is_awaited(peer: str) -> None:
    services = Services()
    owner = next(iter(READS[peer]))
    services.cursors[peer][owner] -= 1

    def catch_up(n: int) -> None:
        if n == 3:
            services.cursors[peer][owner] += 1

    services.at_question = catch_up
    await converging(services).reach("s1")
    assert services.asked == 3


@pytest.mark.parametrize("owner", OWNERS)
async def test_recorder_that_lags_names_the_owner(owner: str) -> None:
    services = Services()
    services.processed["s1", owner] -= 1
    with pytest.raises(Unavailable, match=f"session s1 cannot end yet: the {owner} has not caught up; ask again"):
        await converging(services).reach("s1")
    assert services.asked > 1


async def test_service_that_has_read_nothing_is_named() -> None:
    services = Services()
    services.cursors["learner"] = {}
    with pytest.raises(Unavailable, match="the learner has not caught up"):
        await converging(services).reach("s1")


async def test_service_that_does_not_answer_is_named() -> None:
    with pytest.raises(Unavailable, match="session s1 cannot end yet: the decider does not answer; ask again"):
        await converging(Services(silent=("decider",))).reach("s1")


async def test_journals_that_do_not_fit_together_are_a_conflict() -> None:
    services = Services()
    services.cursors["monitor"]["decider"] = 9
    with pytest.raises(Conflict, match="the monitor has read 9 messages of the decider, whose journal ends at 7"):
        await converging(services).reach("s1")


async def test_recording_with_everything_lacks_nothing() -> None:
    services = Services()
    await converging(services).reach("s1")
    whole = {subjects[0]: HEADS[owner] for owner, subjects in OWNERS.items()}
    whole["session"] += 1  # the recording's own version of the end
    assert converging(services).missing("s1", whole) == ()
    for owner, subjects in OWNERS.items():
        lacking = {**whole, subjects[0]: whole[subjects[0]] - 1}
        assert converging(services).missing("s1", lacking) == (owner,)
    assert converging(services).missing("s1", {}) == tuple(OWNERS)
