"""The desk view's page: pausing the learner, the person's name, and accessibility."""

from __future__ import annotations

import pytest
from shift_runtime.rest_client import RestClient
from support.browser import Tab


def test_learner_is_paused_and_resumed(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="pause1", study="coffee", seed=7)
    tab.go("/session/pause1/desk")
    tab.click("pause")
    tab.wait_text("learner", "q-learning, paused")
    assert shift.config("pause1")["learner"]["paused"] is True
    decision = shift.decide("pause1", "grasp")
    answer = shift.report("pause1", decision["decision_id"], True, 5.0, True, 5.0)
    tab.wait_text("cumulative-reward", f"{answer['cumulative_reward']:.2f}")
    visits = [word for word in tab.text("values").split() if word.isdecimal()]
    assert visits
    assert set(visits) == {"0"}, "nothing was learned"
    tab.click("pause")
    tab.wait_text("pause", "Pause the learner")
    assert shift.config("pause1")["learner"]["paused"] is False


def test_browser_keeps_the_name(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="name1", study="coffee", seed=7)
    tab.go("/session/name1/desk")
    tab.fill("author", "Zoë <b>")
    tab.find("author").blur()
    tab.page.wait_for_function("() => localStorage.getItem('shift-author') === 'Zoë <b>'")
    tab.go("/session/name1/desk")
    tab.page.wait_for_function("() => document.querySelector('[data-testid=author]')?.value === 'Zoë <b>'")


def test_unknown_session_is_named(tab: Tab) -> None:
    tab.go("/session/nobody/desk")
    tab.page.get_by_text("there is no session nobody").wait_for()


def test_ended_session_is_shown_with_what_it_had(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="ended1", study="coffee", seed=7)
    decision = shift.decide("ended1", "grasp")
    shift.end("ended1")
    tab.go("/session/ended1/desk")
    tab.page.get_by_text("This session has ended.").wait_for()
    tab.wait_text("history", decision["cognitive_state"])


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_desk_view_has_no_serious_finding_of_axe(open_tab, shift: RestClient, dark: bool) -> None:
    name = f"axe-{'dark' if dark else 'light'}"
    shift.start("P01", session=name, study="coffee", seed=7)
    for task in ("grasp", "turn"):
        decision = shift.decide(name, task)
        shift.report(name, decision["decision_id"], True, 5.0, task == "turn", 5.0)
    with open_tab(dark=dark) as tab:
        tab.go(f"/session/{name}/desk")
        tab.wait_text("history", "turn")
        tab.fill("strategy-weight-negation", "0.5")
        tab.wait_text("triples-summary", "triples would change")
        assert tab.serious_findings() == []
