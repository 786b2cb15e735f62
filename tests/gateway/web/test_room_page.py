"""The room view in a browser, compared with what REST answers at the same time."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import AoiPositions, GazeChunk
from support.browser import Tab

SCRIPT_TEXT = "<img src=x onerror=document.title='interpreted'>"


def looks(session: str, shift: RestClient, seq: int, aoi: str) -> None:
    """Send one second of gaze at one AOI."""
    t = [seq + i / 10 for i in range(10)]
    shift.gaze(session, GazeChunk(source="glasses", seq=seq, t=t, aoi=[aoi] * 10))


def test_room_view_shows_the_decision_and_the_person_as_rest_does(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="room1", study="coffee", seed=7)
    looks("room1", shift, 0, "cup")
    decision = shift.decide("room1", "grasp")
    tab.go("/session/room1")
    tab.wait_text("decision-number", "1")
    tab.wait_text("gaze-class", shift.observation("room1")["gaze"]["category"])
    observation = shift.observation("room1")
    assert tab.text("strategy") == ", ".join(decision["strategy"].values())
    assert tab.text("cognitive-state") == decision["cognitive_state"]
    assert tab.text("capacity") == f"{observation['capacity']['value']:.2f}"
    assert tab.text("capacity-class") == observation["capacity"]["category"]
    for aoi, weight in observation["gaze"]["weights"].items():
        assert tab.text(f"weight-{aoi}") == f"{weight:.2f}"
    assert "RESULT MISSING" in tab.text("result-pending")
    shift.report("room1", decision["decision_id"], True, 5.0, True, 5.0)
    tab.page.wait_for_function("() => document.querySelector('[data-testid=result-pending]').textContent === ''")
    assert "Hz" in tab.text("gaze-source-glasses")


def test_page_opened_in_the_middle_of_a_session_shows_all_of_it(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="room2", study="coffee", seed=7)
    for n in range(3):
        looks("room2", shift, n, "robot")
        shift.decide("room2", "grasp")
    tab.go("/session/room2")
    tab.wait_text("decision-number", "3")
    lines = "getElement(Number(e.id.slice(1))).chart.getOption().series[0].markLine.data.length"
    three_decisions_and_the_threshold = 4
    tab.page.wait_for_function(
        f"n => {{ const e = document.querySelector('.strip .nicegui-echart'); return {lines} === n }}",
        arg=three_decisions_and_the_threshold,
    )


def test_marker_override_and_end_are_kept(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="room3", study="coffee", seed=7)
    tab.go("/session/room3")
    tab.wait_text("decision-number", "0")
    tab.fill("marker-text", SCRIPT_TEXT)
    tab.click("marker")
    tab.choose("override-task", "turn")
    tab.choose("override-negation", "negation")
    tab.choose("override-hesitation", "hesitation")
    tab.click("override")
    tab.page.get_by_text("next turn:").wait_for()
    decision = shift.decide("room3", "turn")
    assert decision["policy_source"] == "override"
    assert decision["strategy"] == {"negation": "negation", "hesitation": "hesitation"}
    tab.wait_text("strategy", "negation, hesitation")
    assert tab.page.title() != "interpreted"
    tab.click("end")
    tab.click("end-confirm")
    tab.page.get_by_text("This session has ended").wait_for()
    ended = shift.session("room3")
    assert ended["state"] == "ended"
    assert (ended["counts"]["marker"], ended["counts"]["override"]) == (1, 1)


def test_unknown_session_is_named(tab: Tab) -> None:
    tab.go("/session/nobody")
    tab.page.get_by_text("there is no session nobody").wait_for()


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_room_view_has_no_serious_finding_of_axe(open_tab, shift: RestClient, dark: bool) -> None:
    name = f"axe-{'dark' if dark else 'light'}"
    shift.start("P01", session=name, study="coffee", seed=7)
    looks(name, shift, 0, "cup")
    shift.decide(name, "grasp")
    with open_tab(dark=dark) as tab:
        tab.go(f"/session/{name}")
        tab.wait_text("decision-number", "1")
        assert tab.serious_findings() == []


def test_areas_that_move_are_drawn_where_they_are(tab: Tab, shift: RestClient) -> None:
    study = {"study": "moving", "aois": [{"name": "cup", "rectangle": [0.1, 0.1, 0.2, 0.2]}]}
    shift.start("P01", session="moving1", study=study)
    tab.go("/session/moving1")
    cup = tab.page.locator("[data-aoi=cup]")
    expect(cup).to_have_attribute("points", "10.00,6.00 20.00,6.00 20.00,12.00 10.00,12.00")
    for seq, aoi in enumerate(({"rectangle": [0.5, 0.5, 0.75, 1.0]}, {"visible": False})):
        positions = {"source": "tx", "seq": seq, "t": seq, "aois": [{"name": "cup", **aoi}]}
        shift.aois("moving1", AoiPositions.model_validate(positions))
        if seq == 0:
            expect(cup).to_have_attribute("points", "50,30 75,30 75,60 50,60")
    expect(cup).to_be_hidden()
