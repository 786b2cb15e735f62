"""The table of recordings in a browser, compared with what REST answers."""

from __future__ import annotations

import json

import httpx
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk, SetOverride
from support.browser import Tab
from support.whole_mesh import LiveMesh

SCRIPT_TEXT = "<img src=x onerror=document.title='interpreted'>"


def recorded(shift: RestClient, session: str) -> dict[str, object]:
    """Run and end a session with gaze, an override and a change; its end as REST says it."""
    shift.start("P07", session=session, study="coffee", seed=7, condition="adaptive")
    t = [i / 10 for i in range(20)]
    lost = [i % 2 == 0 for i in range(20)]
    shift.gaze(session, GazeChunk(source="tx300", seq=0, t=t, x=[0.2] * 20, y=[0.5] * 20, valid=lost))
    shift.command(SetOverride, session, task="grasp", strategy={"negation": "negation", "hesitation": "none"})
    shift.decide(session, "grasp")
    httpx.patch(f"{shift.url}/v1/sessions/{session}/config", json={"learner": {"epsilon": 0.2}}).raise_for_status()
    shift.decide(session, "turn")
    return shift.end(session)


def test_table_says_what_the_session_was(tab: Tab, shift: RestClient, mesh: LiveMesh) -> None:
    recorded(shift, "table1")
    (mesh.data / "recordings" / "broken.mcap").write_bytes(b"not a recording")
    lost = shift.observation("table1")["gaze"]["lost"]
    tab.go("/recordings")
    tab.wait_text("participant-table1.mcap", "P07")
    assert tab.text("condition-table1.mcap") == "adaptive"
    assert tab.text("decisions-table1.mcap") == "2"
    assert float(tab.text("lost-table1.mcap")) == round(100 * lost, 1)
    assert tab.text("overrides-table1.mcap") == "1"
    assert tab.text("stale-table1.mcap") == "0"
    assert tab.text("changes-table1.mcap") == "1"
    assert tab.text("state-table1.mcap") == "complete"
    assert "not the beginning" in tab.text("state-broken.mcap")
    assert "no significance" in tab.text("no-statistics")
    tab.page.locator('a[href="/recordings/table1.mcap"]').wait_for()


def test_exclusion_is_written_shown_and_taken_back(tab: Tab, shift: RestClient, mesh: LiveMesh) -> None:
    recorded(shift, "table2")
    file = mesh.data / "recordings" / "table2.mcap.exclusion.json"
    tab.go("/recordings")
    tab.click("exclude-table2.mcap")
    tab.fill("exclusion-reason", SCRIPT_TEXT)
    tab.fill("exclusion-author", "Ada")
    tab.click("exclusion-confirm")
    tab.wait_text("exclusion-table2.mcap", f"{SCRIPT_TEXT} (Ada, ")
    assert tab.page.title() != "interpreted"
    assert json.loads(file.read_text())["entries"][0]["excluded"] is True
    tab.page.reload()
    tab.wait_text("exclusion-table2.mcap", "Take back")
    tab.click("exclude-table2.mcap")
    tab.fill("exclusion-reason", "it was fine")
    tab.fill("exclusion-author", "Ada")
    tab.click("exclusion-confirm")
    tab.wait_text("exclusion-table2.mcap", "Exclude…")
    assert [e["excluded"] for e in json.loads(file.read_text())["entries"]] == [True, False]


def test_table_has_no_serious_finding_of_axe(open_tab, shift: RestClient) -> None:
    recorded(shift, "table3")
    for dark in (False, True):
        with open_tab(dark=dark) as tab:
            tab.go("/recordings")
            tab.wait_text("participant-table3.mcap", "P07")
            tab.page.wait_for_timeout(300)
            assert tab.serious_findings() == []
