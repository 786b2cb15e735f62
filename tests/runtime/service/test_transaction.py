"""Transactions: what somebody sees is committed before it is told; a refused commit is undone as a whole."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from shift_runtime.clock import ManualClock
from shift_runtime.metrics import Metrics
from shift_runtime.service import transaction as module
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.states import SessionStates
from shift_runtime.service.transaction import Transactions
from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict
from shift_schemas.messages import OutboxQuery, Override
from support.runtime_fixtures import until
from support.service_parts import Asker, Positions, Schedule, decide, pending, read
from support.worker_rig import CORE, FullDisk, Notes, noted

pytestmark = pytest.mark.anyio


class Desk:
    """The transactions of one service."""

    def __init__(self, path: Path) -> None:
        self.journal = FullDisk(path, "decider", {"override": ("override_id",)})
        self.metrics, self.schedule, self.reader = Metrics("decider"), Schedule(), Positions()
        self.states = SessionStates(CORE, self.journal)
        self.progress = Progress(self.reader, self.journal)
        self.alarm = DiskAlarm(self.journal.check, self.schedule)
        self.transactions = Transactions(
            self.journal, self.states, self.progress, self.alarm, self.metrics, self.schedule
        )

    def note(self, note: str) -> Step[Notes]:
        """Apply a step that publishes one fact."""
        step = noted(self.states.get("s1") or Notes("s1"), note, note, ManualClock(5).now())
        self.transactions.apply_step("s1", step)
        return step

    def configure(self, version: int) -> None:
        """Apply a step that publishes nothing."""
        state = self.states.get("s1") or Notes("s1")
        self.transactions.apply_step("s1", Step(replace(state, config=version)))

    def committed(self) -> Notes | None:
        text = self.journal.state("s1")
        return CORE.load(text) if text is not None else None


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "decider.sqlite")


async def test_step_is_committed_with_its_facts_its_cursors_and_its_answer(desk: Desk) -> None:
    desk.transactions.mark_read(read(1))
    step = desk.note("one")
    desk.transactions.store_answer(pending(), replace(step, result={"n": 1}))
    assert desk.committed() is None
    done = desk.transactions.commit()
    assert done is not None
    assert desk.committed() == Notes("s1", 0, ("one",))
    assert [(r.seq, r.subject) for r in desk.journal.page(OutboxQuery(only=["s1"]), {}).rows] == [(1, "override")]
    assert desk.journal.cursors() == {("s1", "monitor"): 1}
    stored = desk.journal.answer(("s1", "decide", "d1"))
    assert stored is not None
    assert (stored.content, stored.result) == (decide().content(), '{"n": 1}')
    assert [(reply.result, reply.seq, reply.repeat) for reply in done.replies] == [('{"n": 1}', 1, False)]


async def test_result_that_is_a_fact_is_stored_as_its_number(desk: Desk) -> None:
    desk.note("one")
    step = desk.note("two")
    desk.transactions.store_answer(pending(), replace(step, result=step.facts[0]))
    done = desk.transactions.commit()
    assert done is not None
    assert json.loads(done.replies[0].result)["reason"] == "two"
    stored = desk.journal.answer(("s1", "decide", "d1"))
    assert stored is not None
    assert stored.seq == 2


async def test_head_counts_facts_before_and_after_the_commit(desk: Desk) -> None:
    assert desk.transactions.head("s1") == 0
    desk.note("one")
    assert desk.transactions.head("s1") == 1
    desk.transactions.commit()
    desk.note("two")
    assert desk.transactions.head("s1") == 2
    assert desk.transactions.head("s2") == 0


async def test_recall_finds_committed_and_uncommitted_facts(desk: Desk) -> None:
    desk.note("one")
    desk.transactions.commit()
    desk.note("two")
    desk.note("one")
    found = desk.transactions.recall("s1", "override", override_id="one")
    assert [fact.reason for fact in found if isinstance(fact, Override)] == ["one", "one"]
    assert len(desk.transactions.recall("s1", "override", override_id="two")) == 1
    assert desk.transactions.recall("s2", "override", override_id="one") == []


async def test_input_without_visible_effect_waits_for_the_next_commit(desk: Desk) -> None:
    desk.configure(2)
    desk.transactions.mark_read(read(1))
    assert desk.transactions.commit() is not None
    assert desk.journal.commits == 0
    desk.note("one")
    desk.transactions.commit()
    assert desk.journal.commits == 1
    assert desk.committed() == Notes("s1", 2, ("one",))
    assert desk.journal.cursors() == {("s1", "monitor"): 1}


async def test_input_without_visible_effect_is_committed_after_a_while(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "COMMIT_WITHIN_S", 0.002)
    for version in (2, 3):
        desk.configure(version)
        desk.transactions.commit()
    await until(lambda: desk.schedule.items)
    assert len(desk.schedule.items) == 1, "one timer for both"
    desk.schedule.run()
    desk.transactions.commit()
    assert desk.committed() == Notes("s1", 3)
    desk.transactions.commit()
    assert desk.journal.commits == 1


async def test_cursors_alone_are_never_committed(desk: Desk) -> None:
    desk.transactions.mark_read(read(1))
    desk.transactions.force_commit()
    desk.transactions.commit()
    assert desk.journal.commits == 0


async def test_repeated_answer_and_refusal_need_no_commit(desk: Desk) -> None:
    desk.transactions.reply(pending(), "{}", repeat=True)
    desk.transactions.refuse(pending("d2"), Conflict("no"))
    done = desk.transactions.commit()
    assert done is not None
    assert (len(done.replies), len(done.refusals)) == (1, 1)
    assert desk.journal.commits == 0
    again = desk.transactions.commit()
    assert again is not None
    assert (again.replies, again.refusals) == ([], [])


async def test_ended_session_is_closed_by_the_commit(desk: Desk) -> None:
    desk.configure(2)
    desk.transactions.close_session("s1")
    desk.transactions.commit()
    assert desk.journal.closed("s1")


async def test_refused_commit_restores_states_and_cursors_and_refuses_everybody(desk: Desk) -> None:
    desk.transactions.mark_read(read(1))
    desk.note("one")
    desk.transactions.commit()
    desk.reader.cursors["s1", "monitor"] = 1
    desk.configure(2)
    desk.transactions.commit()
    desk.journal.full = True
    lost, refused = Asker(), Asker()
    desk.transactions.mark_read(read(2))
    desk.reader.cursors["s1", "monitor"] = 2
    desk.transactions.store_answer(pending("d1", "any", lost), replace(desk.note("two"), result={}))
    desk.transactions.refuse(pending("d2", "any", refused), Conflict("no"))
    assert desk.transactions.commit() is None
    assert desk.states.get("s1") == Notes("s1", 0, ("one",)), "with what waited for a commit"
    assert desk.reader.cursors == desk.progress.processed == {("s1", "monitor"): 1}
    assert "disk is full" in json.loads(lost.refusals[0])["detail"]
    assert json.loads(refused.refusals[0])["detail"] == "no"
    assert "disk is full" in desk.alarm.detail
    assert desk.transactions.head("s1") == 1


async def test_commit_after_a_refused_one_clears_the_alarm_and_numbers_go_on(desk: Desk) -> None:
    desk.journal.full = True
    desk.note("lost")
    assert desk.transactions.commit() is None
    desk.journal.full = False
    desk.note("one")
    assert desk.transactions.commit() is not None
    assert desk.alarm.detail == ""
    assert desk.committed() == Notes("s1", 0, ("one",))
    assert desk.journal.heads == {"s1": 1}
