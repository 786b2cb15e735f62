"""The desk view in a browser: what it shows is what REST answers, and what it changes is kept."""

from __future__ import annotations

import pytest
from shift_runtime.rest_client import RestClient
from support.browser import WAIT_MS, Tab

SCRIPT_TEXT = "<img src=x onerror=\"document.title='interpreted'\">"


def played(shift: RestClient, name: str, count: int = 3) -> list[dict]:
    """Start a session and play interactions; return the decisions."""
    shift.start("P01", session=name, study="coffee", seed=7)
    made = []
    for n in range(count):
        made.append(shift.decide(name, "grasp", f"d{n + 1}"))
        shift.report(name, f"d{n + 1}", True, 5.0, n > 0, 6.0)
    return made


def policy(shift: RestClient, name: str) -> dict:
    """Return the policy over REST."""
    return shift._ask("GET", f"/v1/sessions/{name}/policy")


def test_desk_shows_what_rest_answers(tab: Tab, shift: RestClient) -> None:
    last = played(shift, "desk1")[-1]
    tab.go("/session/desk1/desk")
    tab.wait_text("history", "d3")
    found = policy(shift, "desk1")
    tab.wait_text("cumulative-reward", f"{found['cumulative_reward']:.3f}")
    observation = shift.observation("desk1")
    assert tab.text("epsilon") == f"{found['epsilon']:.3f}"
    assert tab.text("focus-shift") == f"{observation['gaze']['focus_shift']:.2f}"
    assert tab.text("scores") == ", ".join(f"{k} {v:.3f}" for k, v in last["scores"].items())
    assert tab.text("explored") == str(last["explored"]).lower()
    awareness = observation["awareness"]["grasp"]
    assert tab.text("awareness-grasp").startswith(awareness["category"])
    assert f"comprehension {awareness['comprehension']:.2f}" in tab.text("awareness-grasp")
    for action, p in zip(last["actions"], last["probabilities"], strict=True):
        assert f"{', '.join(action.values())}: {p:.3f}" in tab.text("probabilities")
    for state, row in found["states"].items():
        assert state in tab.text("values")
        for value, visits in zip(row["values"], row["visits"], strict=True):
            assert f"{value:.3f} ({visits})" in tab.text("values")


def test_table_is_edited_after_the_changing_triples_were_shown_and_undone(tab: Tab, shift: RestClient) -> None:
    played(shift, "desk2", 1)
    tab.go("/session/desk2/desk")
    tab.wait_text("triples", "No triple changes")
    tab.fill("author", "Anna")
    tab.fill("table-focused-negation", "1")
    tab.wait_text("triples", "high/focused/unknown: ")
    assert shift.config("desk2")["version"] == 1, "nothing is applied yet"
    tab.click("apply")
    tab.wait_text("changes", "scoring.table.gaze.focused.negation: 0.0 → 1.0")
    config = shift.config("desk2")
    assert (config["version"], config["scoring"]["table"]["gaze"]["focused"]["negation"]) == (2, 1.0)
    assert "Anna" in tab.text("changes")
    tab.find("undo").first.click()
    tab.wait_text("changes", "1.0 → 0.0")
    assert shift.config("desk2")["scoring"]["table"]["gaze"]["focused"]["negation"] == 0.0
    tab.wait_text("triples", "No triple changes")


def test_learner_is_paused_and_goes_on(tab: Tab, shift: RestClient) -> None:
    played(shift, "desk3", 1)
    tab.go("/session/desk3/desk")
    tab.wait_text("history", "d1")
    tab.click("learner-paused")
    tab.wait_text("changes", "learner.paused: false → true")
    before = policy(shift, "desk3")["states"]
    shift.decide("desk3", "grasp", "paused")
    shift.report("desk3", "paused", False, 5.0, False, 5.0)
    after = policy(shift, "desk3")["states"]
    assert {k: v["values"] for k, v in after.items()} == {k: v["values"] for k, v in before.items()}
    tab.click("learner-paused")
    tab.wait_text("changes", "learner.paused: true → false")


def test_result_is_entered_by_hand_and_corrected(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="desk4", study="coffee", seed=7)
    shift.decide("desk4", "grasp", "byhand")
    tab.go("/session/desk4/desk")
    tab.wait_text("history", "byhand")
    tab.fill("result-decision", "byhand")
    tab.fill("result-duration", "4")
    tab.click("result")
    tab.page.get_by_text("The result is kept.").first.wait_for(timeout=WAIT_MS)
    first = policy(shift, "desk4")["cumulative_reward"]
    assert first > 0
    tab.click("result-comprehension")
    tab.click("result-enabledness")
    tab.click("result")
    tab.wait_text("cumulative-reward", "-")
    assert policy(shift, "desk4")["cumulative_reward"] == pytest.approx(-first)
    assert shift.session("desk4")["counts"]["performance"] == 2


def test_override_is_withdrawn_and_marker_is_retracted_as_text(tab: Tab, shift: RestClient) -> None:
    played(shift, "desk5", 1)
    strategy = {"negation": "negation", "hesitation": "none"}
    shift._ask("POST", "/v1/sessions/desk5/override", {"task": "turn", "strategy": strategy})
    shift._ask("POST", "/v1/sessions/desk5/markers", {"text": SCRIPT_TEXT})
    tab.go("/session/desk5/desk")
    tab.wait_text("overrides", "turn: negation")
    tab.wait_text("markers", SCRIPT_TEXT)
    assert tab.page.title() != "interpreted"
    tab.find("overrides").get_by_role("button", name="Withdraw").click()
    tab.page.wait_for_function(
        "() => !document.querySelector('[data-testid=overrides]').textContent.includes('turn')", timeout=WAIT_MS
    )
    assert shift.decide("desk5", "turn")["policy_source"] != "override"
    tab.find("markers").get_by_role("button", name="Retract").click()
    tab.wait_text("markers", "(retracted)")


def test_refused_change_is_shown_and_two_people_see_the_same(open_tab, shift: RestClient) -> None:
    played(shift, "desk6", 1)
    with open_tab() as one, open_tab() as other:
        for tab in (one, other):
            tab.go("/session/desk6/desk")
            tab.wait_text("history", "d1")
        one.fill("table-low-negation", "7")
        one.click("apply")
        one.page.get_by_text("scoring.table.capacity.low.negation").first.wait_for(timeout=WAIT_MS)
        one.click("discard")
        one.fill("strategy-weight-negation", "0.5")
        one.click("apply")
        other.wait_text("changes", "scoring.strategies.negation.weight: 1.0 → 0.5")
        assert other.find("strategy-weight-negation").input_value() == "0.5"


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_desk_has_no_serious_finding_of_axe(open_tab, shift: RestClient, dark: bool) -> None:
    name = f"desk-axe-{dark}".lower()
    played(shift, name)
    with open_tab(dark=dark) as tab:
        tab.go(f"/session/{name}/desk")
        tab.wait_text("history", "d3")
        tab.page.locator(".q-table__middle[tabindex]").first.wait_for()
        assert tab.serious_findings() == []
