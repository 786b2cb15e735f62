"""The worker: commands once, facts once and in their order, everything committed before it is told."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shift_runtime import reader as reader_module
from shift_runtime.service import disk_alarm as disk_alarm_module
from shift_runtime.service import transaction as transaction_module
from shift_schemas.codec import decode, encode
from shift_schemas.errors import Conflict, MalformedMessage, ShiftError, Unavailable, UnknownThing
from shift_schemas.messages import Decide, Decision, Gaze, Marker, OutboxPage, OutboxQuery, Seen
from shift_schemas.timestamps import Stamp
from support.runtime_fixtures import SOON_S, until, until_asked
from support.worker_rig import CORE, Notes, Rig, config, dump, fixation, load, session

RUNNING = pytest.mark.anyio


@pytest.fixture
async def live(tmp_path: Path) -> Any:
    """A worker that has read the start of session s1."""
    rig = Rig(tmp_path / "decider.sqlite")
    rig.recorder.put_out(session(), config())
    rig.start()
    await rig.ready()
    await until(lambda: rig.config() == 1)
    yield rig
    if not rig.running.done():
        await rig.stop()


# --- commands ---


@RUNNING
async def test_a_command_is_committed_published_and_answered_with_its_sequence(live: Rig) -> None:
    answer = await live.decide("d1")
    assert answer.owner == "decider"
    assert answer.seq == 1
    assert answer.result == {"n": 1, "fixations": 0, "timed_out": False}
    assert not answer.repeat
    assert live.outbox() == [(1, "decision d1")]
    await until(lambda: live.published)
    assert [(m.key, m.attachment) for m in live.published] == [("shift/v1/s1/override", b"1")]


@RUNNING
async def test_a_repeat_gets_the_first_result_and_changes_nothing(live: Rig) -> None:
    first = await live.decide("d1")
    await live.decide("d2")
    repeat = await live.decide("d1")
    assert repeat.repeat
    assert repeat.result == first.result
    assert live.outbox() == [(1, "decision d1"), (2, "decision d2")]


@RUNNING
async def test_an_answer_that_is_a_fact_is_repeated_as_it_was_after_a_crash(live: Rig) -> None:
    await live.decide("d1")
    first = await live.decide("d2", "fact")
    assert first.result["reason"] == "decision d2"
    await live.crash()
    live.start()
    repeat = await live.decide("d2", "fact")
    assert (repeat.repeat, repeat.result) == (True, first.result)
    assert live.outbox() == [(1, "decision d1"), (2, "decision d2")]


@RUNNING
async def test_a_repeat_gets_the_first_result_after_a_crash(live: Rig) -> None:
    first = await live.decide("d1")
    await live.crash()
    live.start()
    repeat = await live.decide("d1")
    assert repeat.repeat
    assert repeat.result == first.result
    assert live.outbox() == [(1, "decision d1")]


@RUNNING
async def test_what_the_door_had_seen_is_no_part_of_a_command_s_content(live: Rig) -> None:
    await live.decide("d1")
    assert (await live.decide("d1", need=Seen(decision=7))).repeat


@RUNNING
async def test_the_same_id_with_another_content_is_a_conflict_now_and_after_a_crash(live: Rig) -> None:
    await live.decide("d1", "one")
    for _ in range(2):
        with pytest.raises(Conflict, match="decision d1 was made before, with task one; this request says task other"):
            await live.decide("d1", "other")
        await live.crash()
        live.start()
    assert live.outbox() == [(1, "decision d1")]


@RUNNING
async def test_the_same_command_many_times_at_once_is_carried_out_once(live: Rig) -> None:
    answers = await asyncio.gather(*(live.decide("d1") for _ in range(20)), live.decide("d2"))
    assert [a.repeat for a in answers[:20]] == [False] + [True] * 19
    assert len({json.dumps(a.result) for a in answers[:20]}) == 1
    assert live.outbox() == [(1, "decision d1"), (2, "decision d2")]


@RUNNING
async def test_in_one_turn_the_same_id_with_another_content_is_a_conflict(live: Rig) -> None:
    first, second = await asyncio.gather(live.decide("d1", "one"), live.decide("d1", "other"), return_exceptions=True)
    assert not isinstance(first, BaseException)
    assert isinstance(second, Conflict)


@RUNNING
async def test_a_command_that_breaks_the_core_is_refused_and_the_service_lives_on(live: Rig) -> None:
    with pytest.raises(ShiftError, match=r"because of a mistake of its own \(ZeroDivisionError\)") as found:
        await live.decide("d1", "breaks")
    assert found.value.kind == "internal"
    assert (await live.decide("d2")).result["n"] == 1


# --- waiting ---


@RUNNING
async def test_a_command_waits_for_the_facts_that_it_needs(live: Rig) -> None:
    asked = asyncio.create_task(live.decide("d1", "after-2"))
    live.monitor.put_out(fixation(1), fixation(2))
    answer = await asked
    assert answer.result == {"n": 3, "fixations": 2, "timed_out": False}


@RUNNING
async def test_without_a_hint_it_asks_the_owner_again_while_it_waits(live: Rig) -> None:
    asked = asyncio.create_task(live.decide("d1", "after-2"))
    live.monitor.put_out(fixation(1), fixation(2), hint=False)
    assert (await asked).result["timed_out"] is False


@RUNNING
async def test_it_gives_up_in_time_and_says_that_it_is_late(live: Rig) -> None:
    live.monitor.put_out(fixation(1))
    answer = await live.decide("d1", "after-2")
    assert answer.result == {"n": 2, "fixations": 1, "timed_out": True}
    live.monitor.put_out(fixation(2))
    await until(lambda: len(live.outbox()) == 3)
    assert (await live.decide("d1", "after-2")).result == answer.result


@RUNNING
async def test_repeats_that_come_meanwhile_wait_along_and_get_the_one_answer(live: Rig) -> None:
    asked = [asyncio.create_task(live.decide("d1", "after-1")) for _ in range(5)]
    asked += [asyncio.create_task(live.decide("d1", "after-1", Seen(decision=1)))]
    await asyncio.sleep(0.02)
    live.monitor.put_out(fixation(1))
    answers = await asyncio.gather(*asked)
    assert len({json.dumps(a.result) for a in answers}) == 1
    assert live.outbox() == [(1, "fixation 1"), (2, "decision d1")]


@RUNNING
async def test_one_session_s_waiting_holds_up_no_other(live: Rig) -> None:
    live.recorder.put_out(session("s2"), config("s2"))
    waiting = asyncio.create_task(live.decide("d1", "after-1"))
    await asyncio.sleep(0)
    assert (await live.decide("d1", name="s2")).result["n"] == 1
    assert not waiting.done()
    assert (await waiting).result["timed_out"] is True


# --- unknown ---


@RUNNING
async def test_before_a_session_is_called_unknown_the_recorder_is_asked_again(live: Rig) -> None:
    live.recorder.put_out(session("s2"), config("s2"), hint=False)
    assert (await live.decide("d1", name="s2")).result["n"] == 1


@RUNNING
async def test_what_the_owners_do_not_know_is_unknown(live: Rig) -> None:
    with pytest.raises(UnknownThing):
        await live.decide("d1", name="nobody")
    with pytest.raises(UnknownThing, match="there is no task unknown"):
        await live.decide("d1", "unknown")
    live.monitor.put_out(fixation(1), hint=False)
    assert (await live.decide("d1", "unknown")).result["fixations"] == 1


@RUNNING
async def test_without_the_recorder_nobody_knows(live: Rig) -> None:
    live.recorder.die()
    with pytest.raises(Unavailable, match="cannot know yet: the recorder does not answer"):
        await live.decide("d1", name="nobody")


# --- facts ---


@RUNNING
async def test_facts_that_come_before_their_session_are_held_back_and_applied_in_their_order(live: Rig) -> None:
    live.monitor.put_out(*(fixation(n, "s2") for n in (1, 2, 3)))
    await asyncio.sleep(0.05)
    assert live.outbox("s2") == []
    live.recorder.put_out(session("s2"), config("s2"))
    await until(lambda: len(live.outbox("s2")) == 3)
    live.monitor.put_out(fixation(4, "s2"))
    await until(lambda: len(live.outbox("s2")) == 4)
    assert live.outbox("s2") == [(n, f"fixation {n}") for n in (1, 2, 3, 4)]


@RUNNING
async def test_facts_that_come_before_the_configuration_are_held_back_too(live: Rig) -> None:
    live.recorder.put_out(session("s2"))
    live.monitor.put_out(fixation(1, "s2"), fixation(2, "s2"))
    await asyncio.sleep(0.05)
    assert live.outbox("s2") == []
    live.recorder.put_out(config("s2"), hint=False)
    await until(lambda: len(live.outbox("s2")) == 2)
    assert live.outbox("s2") == [(1, "fixation 1"), (2, "fixation 2")]


@RUNNING
async def test_a_stranger_s_fact_of_a_session_to_come_takes_no_place_in_it(live: Rig) -> None:
    """Well-formed, and of a subject that this service only passes over: sequence 1 is still to come."""
    forged = Marker(session="s2", stamp=Stamp.of(1), marker_id="m", text="")
    gaze = Gaze(session="s2", stamp=Stamp.of(1), source="eyes", seq=0, t=[0.0], aoi=[""])
    live.bus.put("shift/v1/s2/marker", forged.model_dump_json().encode(), attachment=b"1")
    live.bus.put("shift/v1/s2/gaze", gaze.model_dump_json().encode(), attachment=b"1")
    await asyncio.sleep(0.02)
    live.recorder.put_out(session("s2"), config("s2"))
    live.monitor.put_out(fixation(1, "s2"))
    await until(lambda: live.outbox("s2"))
    assert live.outbox("s2") == [(1, "fixation 1")]


@RUNNING
async def test_a_worker_that_was_away_reads_what_it_missed_once(live: Rig) -> None:
    live.monitor.put_out(fixation(1))
    await until(lambda: len(live.outbox()) == 1)
    await live.crash()
    live.monitor.put_out(fixation(2), fixation(3))
    live.start()
    await until(lambda: len(live.outbox()) == 3)
    assert live.notes() == ("fixation 1", "fixation 2", "fixation 3")


@RUNNING
async def test_facts_are_published_in_the_order_of_their_sequence(live: Rig) -> None:
    live.monitor.put_out(*(fixation(n) for n in range(1, 40)))
    await asyncio.gather(*(live.decide(f"d{n}") for n in range(40)))
    await until(lambda: len(live.published) == 79)
    assert [int(m.attachment) for m in live.published] == list(range(1, 80))
    assert [(seq, json.loads(m.payload)["reason"]) for seq, m in enumerate(live.published, 1)] == live.outbox()


@RUNNING
async def test_a_session_that_ended_is_closed_and_read_no_more(live: Rig) -> None:
    await live.decide("d1")
    live.recorder.put_out(session(state="ending"), session(state="ended"))
    await until(lambda: live.journal.closed("s1"))
    live.monitor.put_out(fixation(1))
    await asyncio.sleep(0.05)
    assert live.outbox() == [(1, "decision d1")]
    assert live.worker.states.loaded("s1") is None
    assert (await live.decide("d1")).repeat
    await live.crash()
    live.start()
    await live.ready()
    assert live.worker.reader.done == {"s1"}


# --- commits that can wait ---


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """What can wait for a commit waits for good."""
    monkeypatch.setattr(transaction_module, "COMMIT_WITHIN_S", 60.0)


async def read_configuration(rig: Rig, version: int) -> None:
    """One more thing is read that puts nothing out."""
    rig.recorder.put_out(config(version=version))
    await until(lambda: rig.config() == version)


@RUNNING
@pytest.mark.usefixtures("patient")
async def test_what_puts_nothing_out_is_committed_with_the_next_that_does(live: Rig) -> None:
    await live.decide("d1")
    before = live.journal.commits
    for version in (2, 3, 4):
        await read_configuration(live, version)
    assert live.journal.commits == before
    assert live.committed().config == 1
    await live.decide("d2")
    assert live.journal.commits == before + 1
    assert live.committed() == Notes("s1", 4, ("decision d1", "decision d2"))
    assert live.journal.cursors()["s1", "recorder"] == 5


@RUNNING
async def test_what_puts_nothing_out_is_committed_soon_and_only_once(
    live: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    await live.decide("d1")
    monkeypatch.setattr(transaction_module, "COMMIT_WITHIN_S", 0.02)
    before = live.journal.commits
    await read_configuration(live, 2)
    await until(lambda: live.committed().config == 2)
    await asyncio.sleep(0.1)
    assert live.journal.commits == before + 1


@RUNNING
@pytest.mark.usefixtures("patient")
async def test_what_was_read_and_not_committed_is_read_again_after_a_crash(live: Rig) -> None:
    await live.decide("d1")
    await read_configuration(live, 2)
    await live.crash()
    live.start()
    assert live.committed().config == 1
    await until(lambda: live.config() == 2)
    await live.decide("d2")
    assert live.committed() == Notes("s1", 2, ("decision d1", "decision d2"))


@RUNNING
@pytest.mark.usefixtures("patient")
async def test_a_refused_commit_takes_back_what_waited_for_it_as_well(live: Rig) -> None:
    await live.decide("d1")
    await read_configuration(live, 2)
    live.journal.full = True
    with pytest.raises(Unavailable, match="the disk is full"):
        await live.decide("d2")
    assert live.config() == 1
    live.journal.full = False
    await until(lambda: live.config() == 2)
    await live.decide("d2")
    assert live.committed() == Notes("s1", 2, ("decision d1", "decision d2"))


@RUNNING
async def test_a_repeat_s_answer_needs_no_commit(live: Rig) -> None:
    await live.decide("d1")
    before = live.journal.commits
    assert (await live.decide("d1")).repeat
    assert live.journal.commits == before


# --- a disk that refuses ---


@RUNNING
async def test_a_refused_commit_undoes_its_turn_and_the_repeat_is_carried_out_once(live: Rig) -> None:
    await live.decide("d1")
    await until(lambda: live.published)  # its hint, which comes a little after the answer
    live.journal.full = True
    live.published.clear()
    for name in ("d2", "d3"):
        with pytest.raises(Unavailable, match="the disk is full"):
            await live.decide(name)
    assert live.outbox() == [(1, "decision d1")]
    assert live.published == []
    live.journal.full = False
    answer = await live.decide("d3")
    assert not answer.repeat
    assert answer.seq == 2
    assert answer.result["n"] == 2
    assert live.notes() == ("decision d1", "decision d3")


@RUNNING
async def test_facts_of_a_refused_commit_are_read_again_once_there_is_room(
    live: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader_module, "PULL_EVERY_S", 0.02)
    live.monitor.put_out(fixation(1))
    await until(lambda: len(live.outbox()) == 1)
    live.journal.full = True
    live.monitor.put_out(fixation(2), fixation(3))
    await until(lambda: not live.worker.ready)
    live.monitor.put_out(fixation(4))
    await asyncio.sleep(0.05)
    assert live.outbox() == [(1, "fixation 1")]
    live.journal.full = False
    await until(lambda: len(live.outbox()) == 4)
    assert live.outbox() == [(n, f"fixation {n}") for n in (1, 2, 3, 4)]


@RUNNING
async def test_health_says_that_the_disk_refuses_and_recovers_without_being_asked_for_anything(
    live: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_alarm_module, "CHECK_EVERY_S", 0.02)
    live.journal.full = True
    with pytest.raises(Unavailable):
        await live.decide("d1")
    health = await live.health()
    assert not health.ready
    assert "the disk is full" in health.detail
    await asyncio.sleep(0.06)
    assert not (await live.health()).ready
    live.journal.full = False
    await until(lambda: live.worker.ready)
    assert (await live.health()).detail == ""


# --- health, malformed payloads ---


@RUNNING
async def test_health_names_those_whose_journals_were_not_read_yet(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "decider.sqlite")
    rig.recorder.die()
    rig.monitor.die()
    rig.start()
    health = await rig.health()
    assert not health.ready
    assert health.detail == "waits for the monitor, the recorder"
    rig.recorder.live()
    rig.monitor.live()
    await rig.ready()
    assert (await rig.health()).ready
    await rig.stop()


GOOD = Decide(command_id="d1", session="s1", task="any")
BAD = {
    "empty": b"",
    "no JSON": b"\xff\x00 random",
    "a list": b"[]",
    "another message": encode(OutboxQuery()),
    "unknown field": GOOD.model_dump_json().replace("{", '{"more": 1,', 1).encode(),
    "wrong type": b'{"command_id": 1, "session": "s1", "task": "any"}',
    "NaN": b'{"command_id": "d1", "session": "s1", "task": "any", "need": {"decision": NaN}}',
    "boolean for a number": b'{"command_id": "d1", "session": "s1", "task": "any", "need": {"decision": true}}',
    "hostile id": b'{"command_id": "../x", "session": "s1", "task": "any"}',
    "another session": GOOD.model_copy(update={"session": "s2"}).model_dump_json().encode(),
    "no id": b'{"session": "s1", "task": "any"}',
    "deep": b'{"command_id": ' + b"[" * 100_000,
    "a megabyte": b'{"command_id": "' + b"x" * 2**20 + b'"}',
}


@RUNNING
@pytest.mark.parametrize("payload", BAD.values(), ids=BAD)
async def test_a_malformed_command_is_counted_refused_and_dropped(live: Rig, payload: bytes) -> None:
    (reply,) = await live.ask("shift/v1/s1/rpc/decide", payload)
    assert not reply.ok
    assert json.loads(reply.payload)["kind"] == "malformed"
    assert len(reply.payload) < 5_000
    assert await live.dropped("malformed") == 1
    assert live.outbox() == []
    assert (await live.decide("d1")).seq == 1


@RUNNING
@pytest.mark.parametrize("key", ["shift/v1/*/rpc/decide", "shift/v1/-x/rpc/decide", "shift/v1/a b/rpc/decide"])
async def test_a_command_under_a_key_that_is_none_is_counted_and_refused(live: Rig, key: str) -> None:
    (reply,) = await live.ask(key, encode(GOOD))
    assert not reply.ok
    assert await live.dropped("malformed") == 1


@RUNNING
@pytest.mark.parametrize("payload", [b"", b"{]", b'{"limit": 0}', b'{"cursors": {"*": 1}}', b'{"limit": true}'])
async def test_a_malformed_question_for_the_outbox_is_counted_and_refused(live: Rig, payload: bytes) -> None:
    (reply,) = await live.ask("shift/v1/@service/decider/outbox", payload)
    assert not reply.ok
    assert await live.dropped("malformed") == 1


@RUNNING
async def test_a_malformed_fact_is_counted_and_dropped(live: Rig) -> None:
    live.bus.put("shift/v1/s1/fixation", b"{}", attachment=b"1")
    live.bus.put("shift/v1/s1/fixation", fixation(1).model_dump_json().encode())
    live.monitor.put_out(fixation(1))
    await until(lambda: live.outbox())
    assert await live.dropped("malformed") == 2
    assert live.outbox() == [(1, "fixation 1")]


@RUNNING
async def test_the_outbox_tells_what_was_committed(live: Rig) -> None:
    live.monitor.put_out(fixation(1))
    await until(lambda: live.outbox())
    (reply,) = await live.ask("shift/v1/@service/decider/outbox", encode(OutboxQuery(only=["s1"])))
    page = decode(OutboxPage, reply.payload)
    assert [(r.seq, r.subject) for r in page.rows] == [(1, "override")]
    assert page.heads == {"s1": 1}
    assert page.cursors == {"s1": {"recorder": 2, "monitor": 1}}


@RUNNING
async def test_stop_ends_the_run_and_a_stopped_worker_left_everything_committed(live: Rig) -> None:
    await live.decide("d1")
    await live.stop()
    assert live.running.done()
    live.start()
    assert (await live.decide("d2")).result["n"] == 2


def test_the_small_core_is_loaded_as_it_was_dumped() -> None:
    state = Notes("s1", 1, ("a", "b"))
    assert load(dump(state)) == state
    assert CORE.name == "decider"
    assert issubclass(MalformedMessage, ShiftError)
    assert Decision.subject == "decision"


# --- anything, at any moment ---

EVENT = st.sampled_from(["fact", "fact", "lost fact", "command", "repeat", "full", "room", "crash", "pause"])


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(events=st.lists(EVENT, min_size=1, max_size=25))
def test_facts_and_commands_are_applied_once_whatever_happens(
    tmp_path_factory: pytest.TempPathFactory, events: list[str]
) -> None:
    """Crashes, a full disk, lost hints and repeats in any order: each fact once and in order, each command once."""

    async def test() -> None:
        rig = Rig(tmp_path_factory.mktemp("worker") / "decider.sqlite")
        rig.recorder.put_out(session(), config(), hint=False)
        rig.start()
        facts, commands = 0, 0
        first: dict[str, Any] = {}

        async def ask(name: str) -> bool:
            try:
                answer = await rig.decide(name, timeout_s=SOON_S)
            except Unavailable:
                return False
            assert first.setdefault(name, answer.result) == answer.result
            return True

        for event in events:
            match event:
                case "fact" | "lost fact":
                    facts += 1
                    rig.monitor.put_out(fixation(facts), hint=event == "fact")
                case "command":
                    commands += 1
                    await ask(f"d{commands}")
                case "repeat" if commands:
                    await ask(f"d{(facts * 7) % commands + 1}")
                case "full" | "room":
                    rig.journal.full = event == "full"
                case "crash":
                    await rig.crash()
                    rig.start()
                case "pause":
                    await asyncio.sleep(0.001)
        rig.journal.full = False
        for n in range(1, commands + 1):
            await until_asked(lambda n=n: ask(f"d{n}"))
        await until(lambda: sum("fixation" in note for note in rig.notes()) == facts)
        notes = rig.notes()
        assert [n for n in notes if "fixation" in n] == [f"fixation {n}" for n in range(1, facts + 1)]
        assert sorted(n for n in notes if "decision" in n) == sorted(f"decision d{n}" for n in range(1, commands + 1))
        assert rig.outbox() == list(enumerate(notes, 1))
        await rig.crash()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(disk_alarm_module, "CHECK_EVERY_S", 0.01)
        patch.setattr(reader_module, "PULL_EVERY_S", 0.01)
        asyncio.run(test())
