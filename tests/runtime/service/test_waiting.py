"""Waiting: parked requests are resumed by their inputs or by their deadline, and owners are pulled meanwhile."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from dataclasses import dataclass, field

import pytest
from shift_runtime.service import waiting as module
from shift_runtime.service.background import BackgroundTasks
from shift_runtime.service.requests import PendingRequest
from shift_runtime.service.waiting import Waiting
from shift_schemas.core_protocol import InputsMissing
from support.runtime_fixtures import until
from support.service_parts import Asker, pending

pytestmark = pytest.mark.anyio
NEVER_S = 60.0


@dataclass
class Pulls:
    """A reader that notes what it was asked to pull."""

    owners: tuple[str, ...] = ("recorder", "monitor")
    silent: tuple[str, ...] = ()
    pulled: list[str] = field(default_factory=list)

    def pull_soon(self, owner: str) -> None:
        self.pulled.append(owner)

    async def pull(self, owner: str) -> bool:
        self.pulled.append(owner)
        return owner not in self.silent

    async def pull_all(self, owners: Iterable[str]) -> tuple[str, ...]:
        self.pulled += owners
        return self.silent


@dataclass
class Parking:
    """Waiting, with what it resumes."""

    reader: Pulls = field(default_factory=Pulls)
    resumed: list[PendingRequest] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.tasks = BackgroundTasks()
        self.waiting = Waiting("decider", self.reader, self.tasks, self.resumed.append)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Owners are pulled at once."""
    monkeypatch.setattr(module, "NOTIFICATION_WAIT_S", 0.002)


async def test_parked_requests_of_a_session_are_released_once_oldest_first() -> None:
    parking = Parking()
    first, second, other = pending("d1"), pending("d2"), pending("d1", session="s2")
    for request in (first, second, other):
        parking.waiting.park(request, InputsMissing(("monitor",), NEVER_S))
    assert parking.waiting.release("s1") == [first, second]
    assert parking.waiting.release("s1") == []
    assert parking.waiting.release("s2") == [other]


async def test_request_is_resumed_as_timed_out_at_its_deadline() -> None:
    parking = Parking()
    request = pending()
    parking.waiting.park(request, InputsMissing(("monitor",), 0.01))
    await until(lambda: parking.resumed)
    assert parking.resumed == [request]
    assert request.timed_out
    assert parking.waiting.release("s1") == []


async def test_request_that_is_parked_again_keeps_its_deadline() -> None:
    parking = Parking()
    request = pending()
    parking.waiting.park(request, InputsMissing(("monitor",), 0.02))
    deadline = request.deadline
    parking.waiting.release("s1")
    parking.waiting.park(request, InputsMissing(("monitor",), NEVER_S))
    assert request.deadline == deadline
    await until(lambda: parking.resumed)


async def test_released_request_is_not_timed_out() -> None:
    parking = Parking()
    request = pending()
    parking.waiting.park(request, InputsMissing(("monitor",), 0.01))
    parking.waiting.release("s1")
    await asyncio.sleep(0.03)
    assert not request.timed_out
    assert parking.resumed == []


@pytest.mark.usefixtures("quick")
async def test_missing_owners_are_pulled_again_and_again_until_release() -> None:
    parking = Parking()
    parking.waiting.park(pending(), InputsMissing(("monitor", "learner"), NEVER_S))
    await until(lambda: len(parking.reader.pulled) >= 3)
    assert set(parking.reader.pulled) == {"monitor"}, "the learner is not read here"
    parking.waiting.release("s1")
    pulls = len(parking.reader.pulled)
    await asyncio.sleep(0.03)
    assert len(parking.reader.pulled) == pulls


async def test_equal_command_joins_the_one_that_is_parked() -> None:
    parking = Parking()
    first, again = Asker(), Asker()
    request = pending("d1", "any", first)
    parking.waiting.park(request, InputsMissing(("monitor",), NEVER_S))
    assert parking.waiting.join(pending("d1", "any", again))
    assert request.requests == [first, again]
    for other in (pending("d2"), pending("d1", "other"), pending("d1", session="s2")):
        assert not parking.waiting.join(other)


@pytest.mark.usefixtures("quick")
async def test_owner_of_sessions_is_pulled_before_an_owner_whose_facts_came_early() -> None:
    parking = Parking()
    parking.waiting.read_again("monitor")
    await parking.tasks.wait(5.0)
    assert parking.reader.pulled == ["recorder", "monitor"]


@pytest.mark.usefixtures("quick")
async def test_early_facts_wait_while_the_owner_of_sessions_is_silent() -> None:
    parking = Parking(Pulls(silent=("recorder",)))
    parking.waiting.read_again("monitor")
    await parking.tasks.wait(5.0)
    assert parking.reader.pulled == ["recorder"]


@pytest.mark.parametrize("silent", [(), ("monitor",)])
async def test_unknown_thing_is_checked_with_every_owner_and_then_resumed(silent: tuple[str, ...]) -> None:
    parking = Parking(Pulls(silent=silent))
    request = pending()
    parking.waiting.resume_after_check(request)
    await parking.tasks.wait(5.0)
    assert parking.reader.pulled == ["recorder", "monitor"]
    assert parking.resumed == [request]
    assert request.checked


async def test_unknown_thing_is_refused_as_unavailable_without_the_owner_of_sessions() -> None:
    parking = Parking(Pulls(silent=("recorder",)))
    asker = Asker()
    parking.waiting.resume_after_check(pending("d1", "any", asker))
    await parking.tasks.wait(5.0)
    assert parking.resumed == []
    problem = json.loads(asker.refusals[0])
    assert problem["kind"] == "unavailable"
    assert problem["detail"] == "the decider cannot know yet: the recorder does not answer"
