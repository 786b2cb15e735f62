"""The rows of the table of recordings, without a browser."""

from __future__ import annotations

from dataclasses import replace

from shift_gateway.web.recording_summary import RecordingSummary
from shift_gateway.web.recordings_view import COLUMNS, recording_row
from shift_recording.exclusion import Exclusion, ExclusionEntry
from shift_schemas.timestamps import NS, Stamp

WHOLE = RecordingSummary(
    name="s1.mcap", session="s1", participant="P01", study="coffee", condition="adaptive", started_ns=100 * NS,
    ended_ns=861 * NS, decisions=24, lost=0.0417, overrides=2, stale=1, changes=3,
)  # fmt: skip
NONE = Exclusion(recording="s1.mcap")


def test_row_has_a_value_for_each_column() -> None:
    row = recording_row(WHOLE, NONE, unblinded=False)
    assert [name for name, _, _ in COLUMNS if name not in row] == []
    assert (row["condition"], row["duration"], row["lost"], row["state"]) == ("adaptive", "12:41", 4.2, "complete")
    assert (row["overrides"], row["stale"], row["changes"]) == (2, 1, 3)
    assert not row["excluded"]


def test_condition_of_a_blinded_study_is_hidden_until_somebody_asks() -> None:
    blinded = replace(WHOLE, blinded=True)
    assert recording_row(blinded, NONE, unblinded=False)["condition"] == "blinded"
    assert recording_row(blinded, NONE, unblinded=True)["condition"] == "adaptive"
    assert recording_row(replace(blinded, condition=""), NONE, unblinded=False)["condition"] == ""


def test_exclusion_says_why_and_who() -> None:
    entry = ExclusionEntry(excluded=True, reason="calibration failed", author="Ada", time=Stamp(sec=1, nsec=0))
    row = recording_row(WHOLE, NONE.model_copy(update={"entries": (entry,)}), unblinded=False)
    assert row["excluded"]
    assert row["exclusion"].startswith("calibration failed (Ada, ")


def test_recording_that_is_not_whole_says_why() -> None:
    row = recording_row(RecordingSummary("s2.mcap", reason="it was not finished"), NONE, unblinded=False)
    assert (row["state"], row["started"], row["duration"], row["lost"]) == ("it was not finished", "", "", "")


def test_exclusion_that_cannot_be_read_is_shown_as_such() -> None:
    row = recording_row(WHOLE, "s1.mcap.exclusion.json cannot be read", unblinded=False)
    assert row["exclusion"] == "s1.mcap.exclusion.json cannot be read"
    assert not row["excluded"]
