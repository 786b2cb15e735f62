"""One recording in a browser, compared with what REST said while the session ran."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk, Mark
from support.browser import Tab
from support.whole_mesh import LiveMesh

SCRIPT_TEXT = "<img src=x onerror=document.title='interpreted'>"


def looks(session: str, shift: RestClient, seq: int, aoi: str) -> None:
    """Send one second of gaze at one AOI."""
    t = [seq + i / 10 for i in range(10)]
    shift.gaze(session, GazeChunk(source="glasses", seq=seq, t=t, aoi=[aoi] * 10))


@pytest.fixture(scope="module")
def ended(mesh: LiveMesh) -> dict[str, Any]:
    """A session that has ended: its two decisions, its observation after the first one, and its end."""
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="rec1", study="coffee", seed=7)
        looks("rec1", shift, 0, "cup")
        first = shift.decide("rec1", "grasp")
        shift.report("rec1", first["decision_id"], True, 5.0, True, 5.0)
        shift.command(Mark, "rec1", text=SCRIPT_TEXT)
        looks("rec1", shift, 1, "robot")
        second = shift.decide("rec1", "turn")
        result = shift.report("rec1", second["decision_id"], False, 9.0, True, 4.0)
        observation = shift.observation("rec1")
        shift.end("rec1")
        return {"first": first, "second": second, "result": result, "observation": observation}


def test_end_of_the_recording_shows_what_rest_said(tab: Tab, ended: dict[str, Any]) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.fill("seek", "100000")
    tab.wait_text("decision-number", "2")
    observation = ended["observation"]
    assert tab.text("strategy") == ", ".join(ended["second"]["strategy"].values())
    assert tab.text("cognitive-state") == ended["second"]["cognitive_state"]
    tab.wait_text("capacity", f"{observation['capacity']['value']:.2f}")
    assert tab.text("gaze-class") == observation["gaze"]["category"]
    for aoi, weight in observation["gaze"]["weights"].items():
        assert tab.text(f"weight-{aoi}") == f"{weight:.2f}"
    assert tab.text("cumulative-reward") == f"{ended['result']['cumulative_reward']:.2f}"
    assert tab.text("result-pending") == ""


def test_cursor_shows_the_session_as_it_was_then(tab: Tab, ended: dict[str, Any]) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.page.locator("[data-testid=events] tbody tr", has_text="decision").first.get_by_role("button").click()
    tab.page.wait_for_function("() => document.querySelectorAll('[data-testid=history] tbody tr').length === 1")
    assert tab.text("decision-number") == "1"
    assert tab.text("strategy") == ", ".join(ended["first"]["strategy"].values())


def test_playing_reaches_the_end_and_pausing_stays(tab: Tab, ended: dict[str, Any]) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.choose("rate", "0.25")
    tab.click("play")
    tab.page.wait_for_function("() => Number(document.querySelector('[data-testid=seek]').value) > 0")
    tab.click("pause")
    tab.page.wait_for_timeout(600)
    stood = tab.find("seek").input_value()
    tab.page.wait_for_timeout(600)
    assert tab.find("seek").input_value() == stood
    tab.choose("rate", "30")
    tab.click("play")
    tab.wait_text("decision-number", "2")


def test_events_and_time_line_tell_the_session(tab: Tab, ended: dict[str, Any]) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.wait_text("events", SCRIPT_TEXT)
    assert tab.page.title() != "interpreted"
    assert tab.page.locator("[data-testid=events] tbody tr", has_text="decision").count() == 2
    tab.page.locator("[data-testid=timeline] svg").first.wait_for()
    with tab.page.expect_download() as saved:
        tab.click("save-svg")
    assert saved.value.suggested_filename == "rec1-timeline.svg"
    assert Path(saved.value.path()).read_text().startswith("<svg")


def test_verification_finds_no_difference_and_then_the_first_one(
    tab: Tab, shift: RestClient, ended: dict[str, Any], mesh: LiveMesh
) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.click("verify")
    tab.wait_text("verify-result", "no difference")
    checksum = mesh.data / "recordings" / "rec1.mcap.sha256"
    good = checksum.read_text()
    checksum.write_text("0" * 64 + "  rec1.mcap\n")
    try:
        tab.click("verify")
        tab.wait_text("verify-result", "its SHA-256 should be 0000")
    finally:
        checksum.write_text(good)


def test_download_is_the_file(tab: Tab, ended: dict[str, Any], mesh: LiveMesh) -> None:
    tab.go("/recordings/rec1.mcap")
    with tab.page.expect_download() as loaded:
        tab.click("download")
    assert Path(loaded.value.path()).read_bytes() == (mesh.data / "recordings" / "rec1.mcap").read_bytes()


@pytest.mark.parametrize(("kept", "says"), [(0.6, "it was not finished"), (0, "not the beginning")])
def test_damaged_recording_says_why(tab: Tab, ended: dict[str, Any], mesh: LiveMesh, kept: float, says: str) -> None:
    whole = (mesh.data / "recordings" / "rec1.mcap").read_bytes()
    data = whole[: int(kept * len(whole))] or b"something else"
    (mesh.data / "recordings" / "cut.mcap").write_bytes(data)
    tab.go("/recordings/cut.mcap")
    tab.wait_text("recording-reason", says)


def test_unknown_recording_is_named(tab: Tab) -> None:
    tab.go("/recordings/nobody.mcap")
    tab.page.get_by_text("There is no recording nobody.mcap").wait_for()


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_recording_has_no_serious_finding_of_axe(open_tab, ended: dict[str, Any], dark: bool) -> None:
    with open_tab(dark=dark) as tab:
        tab.go("/recordings/rec1.mcap")
        tab.wait_text("events", "the session is ended")
        tab.page.wait_for_timeout(500)
        assert json.dumps(tab.serious_findings()) == "[]"


def test_recording_is_decided_again_under_another_learner(tab: Tab, ended: dict[str, Any]) -> None:
    tab.go("/recordings/rec1.mcap")
    tab.click("whatif")
    tab.page.get_by_text("Choose another study or another learner.").wait_for()
    tab.page.locator("[data-testid=whatif-learner]").click()
    tab.page.get_by_role("option", name="scoring", exact=True).click()
    tab.click("whatif")
    tab.wait_text("whatif-result", "of 2 decisions would have used another strategy")
    rows = tab.page.locator("[data-testid=whatif-values] tbody tr")
    rows.nth(3).wait_for()
    assert [rows.nth(i).locator("th,td").first.inner_text() for i in range(4)] == [
        "recorded", "IPS", "SNIPS", "doubly robust",
    ]  # fmt: skip
    suggested = [ended[name]["suggested"] for name in ("first", "second")]
    counts = tab.text("whatif-counts")
    for strategy in suggested:
        assert " + ".join(strategy.values()).replace("_", " ") in counts
    assert "participants: 1" in tab.text("whatif-warnings")
    tab.page.locator("[data-testid=whatif-chart] svg").wait_for()
    assert "doubly robust" in tab.text("whatif-chart")
