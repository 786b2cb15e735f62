"""Results are entered by hand and corrected in a browser."""

from __future__ import annotations

from shift_recording.mcap.reader import facts
from shift_runtime.rest_client import RestClient
from support.browser import Tab
from support.whole_mesh import LiveMesh


def test_result_is_entered_and_corrected(tab: Tab, mesh: LiveMesh, shift: RestClient) -> None:
    shift.start("P01", session="result1", study="coffee", seed=7)
    decision = shift.decide("result1", "grasp")
    tab.go("/session/result1/desk")
    tab.wait_text("result-decision", "1 · grasp · no result")
    tab.fill("author", "Ben")
    tab.fill("result-duration", "4.5")
    tab.click("result-comprehension")
    tab.click("result")
    tab.wait_text("awareness-grasp", "misconception_enabledness")
    tab.wait_text("changes", "Ben")
    tab.page.get_by_text("This decision has a result; yours replaces it.").wait_for()
    tab.click("result-enabledness")
    tab.fill("result-duration-enabledness", "6")
    tab.click("result")
    tab.wait_text("history", "(corrected)")
    tab.wait_text("awareness-grasp", "success")
    ended = shift.end("result1")
    reports = [f.fact for f in facts(mesh.data / "recordings" / ended["recording"]) if f.fact.subject == "performance"]
    shown = [
        (p.author, p.corrects, p.comprehension.success, p.comprehension.duration_s, p.enabledness.success,
         p.enabledness.duration_s) for p in reports if p.decision_id == decision["decision_id"]
    ]  # fmt: skip
    assert shown == [("Ben", False, True, 4.5, False, 4.5), ("Ben", True, True, 4.5, True, 6.0)]


def test_time_that_is_no_number_is_refused(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="result2", study="coffee", seed=7)
    shift.decide("result2", "grasp")
    tab.go("/session/result2/desk")
    tab.wait_text("result-decision", "1 · grasp · no result")
    tab.fill("result-duration", "soon")
    tab.click("result")
    tab.page.get_by_text("write seconds, from 0 to 1000000").wait_for()
    assert shift.session("result2")["counts"].get("performance", 0) == 0
