"""The start page in a browser: a session is started with nothing but the page."""

from __future__ import annotations

import os
import signal

import pytest
from shift_runtime.rest_client import RestClient
from support.browser import Tab
from support.whole_mesh import LiveMesh

TITLE = """<img src=x onerror="document.title='interpreted'">"""


def test_newcomer_sees_three_steps_and_every_service_is_ok(tab: Tab, mesh: LiveMesh) -> None:
    tab.go("/")
    for service in ("recorder", "monitor", "decider", "learner", "gateway"):
        tab.wait_text(f"service-{service}", "ok: ")
        assert "Last heard at " in tab.text(f"service-{service}")
    assert "GB" in tab.text("disk")
    tab.page.get_by_text(f"curl -X POST {mesh.url}/v1/sessions").wait_for()
    tab.page.get_by_text("Stream gaze").wait_for()


def test_session_is_started_and_listed(tab: Tab, shift: RestClient) -> None:
    tab.go("/")
    tab.wait_text("start-participant", "P0")
    tab.fill("start-participant", "P42")
    tab.choose("start-study", "coffee: Making coffee with a robot")
    tab.click("start")
    tab.page.get_by_text("Choose the condition: control, adaptive.").wait_for()
    tab.choose("start-condition", "adaptive")
    tab.page.get_by_text("More").click()
    tab.fill("start-seed", "7")
    tab.fill("start-session", "from-page")
    tab.click("start")
    tab.page.wait_for_url("**/session/from-page")
    session = shift.session("from-page")
    assert (session["participant"], session["condition"], session["seed"]) == ("P42", "adaptive", 7)
    tab.go("/")
    tab.wait_text("sessions", "from-page")
    for word in ("P42", "coffee", "adaptive", "live"):
        assert word in tab.text("sessions")


def test_refusal_is_shown_as_a_sentence(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="twice")
    tab.go("/")
    tab.wait_text("start-participant", "P")
    tab.page.get_by_text("More").click()
    tab.fill("start-session", "twice")
    tab.click("start")
    tab.page.get_by_text("session twice is there already").wait_for()


def test_title_of_a_study_is_text_and_its_mistakes_are_shown(tab: Tab, mesh: LiveMesh) -> None:
    studies = mesh.data / "studies"
    (studies / "odd.yaml").write_text(f"study: odd\ntitle: '{TITLE.replace(chr(39), chr(39) * 2)}'\n")
    (studies / "wrong.yaml").write_text("study: wrong\ninteractions: none\n")
    tab.go("/")
    tab.wait_text("start-participant", "P")
    tab.choose("start-study", f"odd: {TITLE}")
    assert tab.page.title() != "interpreted"
    tab.choose("start-study", "wrong (has mistakes)")
    tab.page.get_by_text("wrong.yaml:2").wait_for()


def test_gaze_source_is_judged_and_a_silent_service_is_a_fault(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="gaze")
    tab.go("/")
    tab.wait_text("service-monitor", "ok: ")
    body = {"source": "glasses", "seq": 0, "t": [i / 10 for i in range(20)], "aoi": ["left"] * 20}
    shift._ask("POST", "/v1/sessions/gaze/gaze", body)
    tab.wait_text("gaze-source-glasses", "10 Hz")
    learner = mesh.pid_of("shift_learner")
    os.kill(learner, signal.SIGSTOP)
    try:
        tab.wait_text("service-learner", "fault: The learner does not answer")
    finally:
        os.kill(learner, signal.SIGCONT)
    tab.wait_text("service-learner", "ok: ")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_start_page_has_no_serious_finding_of_axe(open_tab, shift: RestClient, dark: bool) -> None:
    with open_tab(dark=dark) as tab:
        tab.go("/")
        tab.wait_text("service-monitor", "ok: ")
        assert tab.serious_findings() == []
