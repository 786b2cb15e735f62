"""The list of changes in a browser: undo, withdraw and retract."""

from __future__ import annotations

import httpx
from shift_runtime.rest_client import RestClient
from support.browser import Tab
from support.whole_mesh import LiveMesh

SCRIPT_TEXT = "<img src=x onerror=document.title='interpreted'>"
NEGATED = {"negation": "negation", "hesitation": "none"}


def ask(mesh: LiveMesh, method: str, path: str, body: object) -> None:
    """Send a request that succeeds."""
    httpx.request(method, f"{mesh.url}/v1/sessions/{path}", json=body, timeout=30).raise_for_status()


def test_configuration_is_undone_with_one_click(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="undo1", study="coffee", seed=7)
    ask(mesh, "PATCH", "undo1/config?author=Anna", {"capacity": {"recovery": 0.1}})
    ask(mesh, "PATCH", "undo1/config?author=Ben", {"reward": {"scale": 2}})
    tab.go("/session/undo1/desk")
    tab.fill("author", "Cleo")
    tab.page.get_by_role("button", name="undo configuration 2", exact=True).click()
    tab.wait_text("changes", "capacity.recovery 0.1 → 0.3")
    tab.wait_text("changes", "Cleo")
    config = shift.config("undo1")
    assert (config["version"], config["capacity"]["recovery"], config["reward"]["scale"]) == (4, 0.3, 2.0)
    assert tab.find("undo").count() == 2, "configuration 2 is undone; 3 and 4 hold"


def test_override_is_withdrawn(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="undo2", study="coffee", seed=7)
    ask(mesh, "POST", "undo2/override", {"task": "turn", "strategy": NEGATED, "override_id": "o1"})
    tab.go("/session/undo2/desk")
    tab.wait_text("changes", "waits for the task's next decision")
    tab.click("withdraw")
    tab.wait_text("changes", "withdrawn")
    assert shift.decide("undo2", "turn")["policy_source"] != "override"


def test_marker_is_retracted_by_a_second_one_and_never_interpreted(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="undo3", study="coffee", seed=7)
    ask(mesh, "POST", "undo3/markers", {"text": SCRIPT_TEXT, "author": SCRIPT_TEXT})
    tab.go("/session/undo3/desk")
    tab.wait_text("changes", SCRIPT_TEXT)
    tab.find("retract").press("Enter")
    tab.wait_text("changes", "retraction")
    tab.wait_text("changes", "retracted")
    assert tab.find("retract").count() == 0
    assert shift.session("undo3")["counts"]["marker"] == 2
    assert tab.page.title() != "interpreted"


def test_refusal_is_shown(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="undo4", study="coffee", seed=7)
    ask(mesh, "POST", "undo4/markers", {"text": "late"})
    tab.go("/session/undo4/desk")
    tab.find("retract").wait_for()
    shift.end("undo4")
    tab.click("retract")
    tab.page.get_by_text("session undo4 has ended").first.wait_for()
