"""A recording in the browser: the time line, the views under the cursor, verify and download."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from support.browser import WAIT_MS, Tab
from support.whole_mesh import LiveMesh

SCRIPT_TEXT = "<img src=x onerror=\"document.title='interpreted'\">"


@pytest.fixture(scope="module")
def recorded(mesh: LiveMesh) -> Path:
    """Return the recording of a session with gaze, three decisions, a change and a marker."""
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="rec", study="coffee", seed=7, condition="adaptive")
        for n in range(3):
            t = [n + i / 10 for i in range(10)]
            shift.gaze("rec", GazeChunk(source="glasses", seq=n, t=t, aoi=["cup"] * 10))
            shift.decide("rec", "grasp", f"d{n + 1}")
            shift.report("rec", f"d{n + 1}", True, 5.0, n > 0, 6.0)
        shift._ask("PATCH", "/v1/sessions/rec/config", {"reward": {"scale": 0.5}})
        shift._ask("POST", "/v1/sessions/rec/markers", {"text": SCRIPT_TEXT})
        return mesh.data / "recordings" / shift.end("rec")["recording"]


def test_recording_shows_its_end_and_every_event(tab: Tab, recorded: Path) -> None:
    tab.go("/recordings/rec.mcap")
    tab.wait_text("decision-number", "3")
    assert "participant P01" in (tab.page.locator("main").first.text_content() or "")
    tab.wait_text("events", "reward.scale: 1.0 → 0.5")
    tab.wait_text("events", SCRIPT_TEXT)
    tab.wait_text("history", "d3")
    assert tab.page.title() != "interpreted"
    assert tab.find("timeline").locator("svg").count() == 1


def test_views_follow_the_cursor_and_playing_moves_it(tab: Tab, recorded: Path) -> None:
    tab.go("/recordings/rec.mcap")
    tab.wait_text("decision-number", "3")
    tab.fill("seek", "0")
    tab.wait_text("decision-number", "0")
    assert tab.text("strategy") == ""
    tab.choose("rate", "0.5 ×")
    tab.click("play")
    tab.wait_text("decision-number", "3")
    tab.click("pause")


def test_verify_finds_no_difference_and_the_download_is_the_file(tab: Tab, recorded: Path) -> None:
    tab.go("/recordings/rec.mcap")
    tab.click("verify")
    tab.wait_text("verify-result", "no difference")
    tab.page.get_by_text("The checksum matches.").wait_for(timeout=WAIT_MS)
    with tab.page.expect_download() as download:
        tab.click("download")
    found = Path(str(download.value.path())).read_bytes()
    assert hashlib.sha256(found).hexdigest() == hashlib.sha256(recorded.read_bytes()).hexdigest()


def test_time_line_is_saved_as_svg(tab: Tab, recorded: Path) -> None:
    tab.go("/recordings/rec.mcap")
    tab.wait_text("decision-number", "3")
    with tab.page.expect_download() as download:
        tab.page.get_by_role("button", name="Save as SVG").click()
    assert download.value.suggested_filename == "rec-time-line.svg"
    assert Path(str(download.value.path())).read_text().startswith("<svg")


def test_changed_recording_is_shown_and_its_first_difference_named(tab: Tab, mesh: LiveMesh, recorded: Path) -> None:
    data = bytearray(recorded.read_bytes())
    (mesh.data / "recordings" / "cut.mcap").write_bytes(data[: len(data) // 2])
    tab.go("/recordings/cut.mcap")
    tab.page.get_by_text("Not complete").wait_for(timeout=WAIT_MS)
    tab.click("verify")
    tab.page.wait_for_function(
        "() => document.querySelector('[data-testid=verify-result]').textContent.length > 0", timeout=WAIT_MS
    )
    assert tab.text("verify-result") != "no difference"


def test_unknown_recording_is_named(tab: Tab) -> None:
    tab.go("/recordings/nobody.mcap")
    tab.page.get_by_text("there is no recording nobody.mcap").wait_for(timeout=WAIT_MS)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_recording_has_no_serious_finding_of_axe(open_tab, recorded: Path, dark: bool) -> None:
    with open_tab(dark=dark) as tab:
        tab.go("/recordings/rec.mcap")
        tab.wait_text("decision-number", "3")
        tab.page.locator(".q-table__middle[tabindex]").first.wait_for()
        assert tab.serious_findings() == []
