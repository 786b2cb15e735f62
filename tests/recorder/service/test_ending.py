"""The end of a session: committed first, then finished in the background, then answered."""

from __future__ import annotations

import asyncio
import json

import pytest
from shift_recorder.service import convergence
from shift_recorder.service import ending as module
from shift_recording.durable_file import StorageFailed
from shift_recording.mcap.reader import Recording
from shift_schemas.errors import Conflict, ShiftError, Unavailable
from shift_schemas.messages import Mark
from support.recorder_rig import END, RecorderRig
from support.runtime_fixtures import until

pytestmark = pytest.mark.anyio
WHOLE = {"session": 3, "config": 1}
"""Messages of a session that was live, ending and ended."""
MARK = Mark(command_id="m1", session="s1", text="after the end")


async def test_end_is_answered_once_the_recording_is_finished(rig: RecorderRig) -> None:
    rig.caught_up(3)
    answer = await rig.send(END)
    assert answer.result["state"] == "ended"
    assert answer.result["counts"] == WHOLE
    sessions = [json.loads(m.data)["state"] for m in Recording(rig.recording).messages({"session"})]
    assert sessions == ["live", "ending", "ended"]
    await until(lambda: rig.journal.closed("s1"))
    assert rig.segments == []


async def test_everybody_who_asks_for_the_end_gets_the_one_result(rig: RecorderRig) -> None:
    rig.caught_up(3)
    answers = await asyncio.gather(*(rig.send(END) for _ in range(5)))
    assert len({answer.result["sha256"] for answer in answers}) == 1
    again = await rig.send(END)
    assert again.repeat
    assert again.result == answers[0].result


async def test_session_that_is_ending_takes_no_commands(rig: RecorderRig) -> None:
    ending = asyncio.create_task(rig.send(END))
    await until(lambda: rig.state() == "ending")
    with pytest.raises(Conflict, match="session s1 has ended"):
        await rig.send(MARK)
    assert not ending.done()
    rig.caught_up(3)
    assert (await ending).result["state"] == "ended"


async def test_end_that_a_service_delays_too_long_is_refused_and_can_be_asked_again(
    rig: RecorderRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(convergence, "END_WAIT_S", 0.05)
    with pytest.raises(Unavailable, match="session s1 cannot end yet: the monitor has not caught up; ask again"):
        await rig.send(END)
    assert rig.state() == "ending"
    rig.caught_up(3)
    assert (await rig.send(END)).result["state"] == "ended"


async def test_end_that_a_crash_interrupted_goes_on_by_itself(rig: RecorderRig) -> None:
    asked = asyncio.create_task(rig.send(END))
    await until(lambda: rig.state() == "ending")
    await rig.crash()
    asked.cancel()
    rig.caught_up(3)
    rig.start()
    await until(lambda: rig.journal.closed("s1"))
    assert (await rig.send(END)).result["sha256"]


async def test_end_with_a_full_disk_is_refused_and_raises_the_alarm(
    rig: RecorderRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.caught_up(3)
    merge = module.merge_session

    def full(*given: object) -> None:
        raise StorageFailed("the disk is full")

    monkeypatch.setattr(module, "merge_session", full)
    with pytest.raises(Unavailable, match="the disk is full"):
        await rig.send(END)
    assert rig.worker.alarm.detail == "the disk is full"
    monkeypatch.setattr(module, "merge_session", merge)
    assert (await rig.send(END)).result["counts"] == WHOLE


async def test_mistake_while_finishing_is_refused_and_the_end_can_be_asked_again(
    rig: RecorderRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.caught_up(3)
    merge = module.merge_session
    monkeypatch.setattr(module, "merge_session", lambda *given: 1 // 0)
    with pytest.raises(ShiftError, match="the recorder failed to finish s1: ZeroDivisionError; see its log"):
        await rig.send(END)
    monkeypatch.setattr(module, "merge_session", merge)
    assert (await rig.send(END)).result["state"] == "ended"


async def test_damaged_segment_is_written_again_from_the_journals(rig: RecorderRig) -> None:
    await rig.recorded(2)
    await asyncio.sleep(0)
    (segment,) = rig.segments
    ending = asyncio.create_task(rig.send(END))
    await until(lambda: rig.state() == "ending")
    segment.write_bytes(segment.read_bytes()[:100])
    rig.caught_up(3)
    assert (await ending).result["counts"] == WHOLE


async def test_recorder_that_stops_leaves_a_recording_of_the_live_session(rig: RecorderRig) -> None:
    await rig.recorded(2)
    await rig.stop()
    assert [m.topic for m in Recording(rig.recording).messages()] == ["session", "config"]
    assert rig.segments == []
    rig.start()
    rig.caught_up(3)
    assert (await rig.send(END)).result["counts"] == WHOLE
