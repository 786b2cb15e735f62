"""What the start page shows, without a browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_gateway.web.start_view import (
    disk_check,
    lag_check,
    proposed_participant,
    service_check,
    session_row,
    study_choice,
)
from shift_runtime.study_files import check_file
from shift_schemas.messages import Health
from shift_schemas.timestamps import NS

NOW = 1_700_000_000 * NS
SESSION = {
    "session": "s1", "participant": "P01", "study": "lamp", "condition": "adaptive", "state": "live",
    "started": {"sec": 1_700_000_000 - 761, "nsec": 0}, "ended": None, "recording": "",
    "counts": {"decision": 7, "performance": 6},
}  # fmt: skip


@pytest.mark.parametrize(
    ("known", "next_one"), [([], "P01"), (["P01", "P07", "anna"], "P08"), (["P099"], "P100"), (["p3", "Px"], "P01")]
)
def test_next_free_pseudonym_is_proposed(known: list[str], next_one: str) -> None:
    assert proposed_participant(known) == next_one


def test_service_that_does_not_answer_is_a_fault_with_the_time_it_was_last_heard() -> None:
    silent = service_check("monitor", None, NOW)
    assert silent.level == "fault"
    assert "does not answer" in silent.text
    assert "Last heard at" in silent.text
    assert "Not heard yet" in service_check("monitor", None, None).text


def test_service_that_is_not_ready_says_why() -> None:
    health = Health(service="learner", ready=False, detail="waits for the recorder")
    assert service_check("learner", health, NOW).text.startswith(
        "warning: The learner is not ready: waits for the recorder"
    )
    assert service_check("learner", Health(service="learner", ready=True), NOW).level == "ok"


@pytest.mark.parametrize(("free_gb", "level"), [(100, "ok"), (4.9, "warning"), (0.9, "fault")])
def test_little_room_on_the_disk_is_a_warning_and_then_a_fault(free_gb: float, level: str) -> None:
    check = disk_check(int(free_gb * 1e9), int(500e9), NOW)
    assert check.level == level
    assert f"{free_gb:.1f} GB of 500 GB" in check.sentence


@pytest.mark.parametrize(("behind", "level"), [(0, "ok"), (5000, "warning"), (None, "warning")])
def test_lag_of_the_recorder_is_judged(behind: int | None, level: str) -> None:
    assert lag_check(behind, NOW).level == level


def test_condition_of_a_blinded_study_is_hidden_until_the_session_has_ended() -> None:
    assert session_row(SESSION, True, NOW)["condition"] == "blinded"
    assert session_row(SESSION, False, NOW)["condition"] == "adaptive"
    ended = {**SESSION, "state": "ended", "ended": {"sec": 1_700_000_000, "nsec": 0}}
    row = session_row(ended, True, NOW + 99 * NS)
    assert (row["condition"], row["duration"], row["decisions"]) == ("adaptive", "12:41", 7)


def test_study_with_mistakes_cannot_be_started_and_says_why(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text("study: bad\ninteractions: none\n")
    choice = study_choice(check_file(tmp_path / "bad.yaml", "bad.yaml"))
    assert not choice.startable
    assert "bad.yaml:2" in choice.remarks[0]
