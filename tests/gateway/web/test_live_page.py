"""An open page through what happens around it: a gateway that restarts, a mesh that is away, and no page at all."""

from __future__ import annotations

import os
import signal

from support.browser import Tab
from support.whole_mesh import LiveMesh

WATCH_UPDATES = """
() => { window.updates = 0;
  new MutationObserver(() => { window.updates += 1; }).observe(
    document.querySelector('[data-testid="result-pending"]'), {childList: true, characterData: true, subtree: true});
  const heard = shift.heard; window.heards = 0;
  shift.heard = (ms) => { window.heards += 1; heard(ms); }; }
"""


def test_page_comes_back_by_itself_after_the_gateway_was_killed(tab: Tab, mesh: LiveMesh, shift) -> None:
    shift.start("P01", session="back", study="coffee", seed=7)
    shift.decide("back", "grasp")
    tab.go("/session/back")
    tab.wait_text("decision-number", "1")
    mesh.kill("shift_gateway")
    mesh.wait_ready()
    shift.decide("back", "grasp")
    tab.wait_text("decision-number", "2")


def test_values_are_marked_as_old_while_a_service_does_not_answer(tab: Tab, mesh: LiveMesh, shift) -> None:
    shift.start("P01", session="old", study="coffee", seed=7)
    tab.go("/session/old")
    tab.wait_text("decision-number", "0")
    monitor = mesh.pid_of("shift_monitor")
    os.kill(monitor, signal.SIGSTOP)
    try:
        tab.page.wait_for_function("() => document.body.classList.contains('is-old')")
        banner = tab.page.locator(".old-values").text_content() or ""
        assert banner.startswith("Old values: last heard from the mesh at ")
    finally:
        os.kill(monitor, signal.SIGCONT)
    tab.page.wait_for_function("() => !document.body.classList.contains('is-old')")


def test_open_page_updates_at_least_four_times_a_second(tab: Tab, shift) -> None:
    shift.start("P01", session="often", study="coffee", seed=7)
    shift.decide("often", "grasp")
    tab.go("/session/often")
    tab.wait_text("decision-number", "1")
    tab.page.evaluate(WATCH_UPDATES)
    tab.page.wait_for_function("() => window.heards >= 20")
    assert tab.page.evaluate("() => window.updates") >= 2, "the age of the pending result changes every second"
