"""The desk view's panels in a browser, compared with what REST answers at the same time."""

from __future__ import annotations

from typing import Any

import httpx
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from support.browser import Tab
from support.whole_mesh import LiveMesh

WIDER = {
    "study": "wider",
    "scoring": {
        "strategies": {"repetition": {"levels": ["once", "twice"], "thresholds": [0.5]}},
        "table": {
            "capacity": {c: {"repetition": 0} for c in ("low", "high")},
            "gaze": {g: {"repetition": 1} for g in ("distracted", "uncertain", "focused")},
            "awareness": {
                a: {"repetition": 1}
                for a in (
                    "unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success",
                )
            },
        },
    },
}  # fmt: skip


def policy(mesh: LiveMesh, session: str) -> dict[str, Any]:
    """Return the policy as REST has it."""
    found: dict[str, Any] = httpx.get(f"{mesh.url}/v1/sessions/{session}/policy", timeout=30).json()
    return found


def test_desk_shows_what_rest_answers(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="desk1", study="coffee", seed=7)
    shift.gaze("desk1", GazeChunk(source="glasses", seq=0, t=[0.0, 0.5, 1.0, 1.5], aoi=["cup", "robot", "cup", "cup"]))
    for task in ("grasp", "turn"):
        decision = shift.decide("desk1", task)
        shift.report("desk1", decision["decision_id"], True, 5.0, False, 5.0)
    last = shift.decide("desk1", "pour")
    tab.go("/session/desk1/desk")
    tab.wait_text("history", "pour")
    observation, learned = shift.observation("desk1"), policy(mesh, "desk1")
    tab.wait_text("focus-shift", f"{observation['gaze']['focus_shift']:.2f}")
    assert tab.text("epsilon") == f"{learned['epsilon']:.2f}"
    assert tab.text("cumulative-reward") == f"{learned['cumulative_reward']:.2f}"
    assert tab.text("scores") == ", ".join(f"{n} {s:.2f}" for n, s in last["scores"].items())
    assert tab.text("explored") == str(last["explored"]).lower()
    for p in last["probabilities"]:
        assert f"{p:.2f}" in tab.text("probabilities")
    for task, seen in observation["awareness"].items():
        shown = tab.text(f"awareness-{task}").split()
        assert shown == [task, seen["category"], f"{seen['comprehension']:.2f}", f"{seen['enabledness']:.2f}", "1"]
    values = tab.text("values").split()
    for state, row in learned["states"].items():
        at = values.index(state)
        wanted = [word for v, n in zip(row["values"], row["visits"], strict=True) for word in (f"{v:.2f}", "n", str(n))]
        assert values[at + 1 : at + 1 + len(wanted)] == wanted
    first = tab.find("decision-1").text_content() or ""
    assert "grasp" in first


def test_selected_decision_is_explained_and_stays_selected(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="desk2", study="coffee", seed=7)
    first = shift.decide("desk2", "grasp")
    shift.report("desk2", first["decision_id"], True, 5.0, True, 5.0)
    shift.decide("desk2", "turn")
    tab.go("/session/desk2/desk")
    tab.page.get_by_role("button", name="Show decision 1", exact=True).press("Enter")
    tab.page.get_by_text("How the decision came about: decision 1, grasp").wait_for()
    assert tab.text("scores") == ", ".join(f"{n} {s:.2f}" for n, s in first["scores"].items())
    shift.decide("desk2", "pour")
    tab.wait_text("history", "pour")
    assert tab.page.get_by_text("How the decision came about: decision 1, grasp").is_visible()


def test_study_with_further_strategies_has_all_its_states_and_columns(
    tab: Tab, mesh: LiveMesh, shift: RestClient
) -> None:
    shift.start("P01", session="desk3", study=WIDER, seed=7)
    shift.decide("desk3", "grasp")
    tab.go("/session/desk3/desk")
    tab.wait_text("history", "grasp")
    states = policy(mesh, "desk3")["states"]
    assert len(states) == 12
    shown = tab.page.locator('[data-testid="values"] tbody th').all_text_contents()
    assert shown == list(states)
    assert tab.find("table-low-repetition").input_value() == "0"
    assert tab.find("strategy-weight-repetition").input_value() == "1"
