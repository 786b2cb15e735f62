"""A running replay is shown and controlled on the page of the recordings."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
from shift_runtime.rest_client import RestClient
from support.browser import Tab
from support.whole_mesh import LiveMesh


@contextmanager
def replaying(mesh: LiveMesh, shift: RestClient, session: str) -> Iterator[subprocess.Popen[bytes]]:
    """Record a short session, and replay it very slowly under the given name."""
    shift.start("P07", session=f"of-{session}", study="coffee", seed=7)
    for task in ("grasp", "turn", "pour"):
        shift.decide(f"of-{session}", task)
    shift.end(f"of-{session}")
    file = mesh.data / "recordings" / f"of-{session}.mcap"
    line = [sys.executable, "-m", "shift_cli.main", "replay", str(file), "--session", session, "--zenoh", mesh.zenoh]
    process = subprocess.Popen([*line, "--speed", "0.001"], stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        mesh.until(lambda: httpx.get(f"{mesh.url}/v1/replays/{session}").status_code == 200)
        yield process
    finally:
        if process.poll() is None:
            os.kill(process.pid, signal.SIGTERM)
        process.wait(20)


def test_replay_is_paused_stepped_sped_up_and_stopped(tab: Tab, shift: RestClient, mesh: LiveMesh) -> None:
    def status() -> dict[str, object]:
        found: dict[str, object] = httpx.get(f"{mesh.url}/v1/replays/shown").json()
        return found

    with replaying(mesh, shift, "shown") as process:
        tab.go("/recordings")
        tab.wait_text("replay-shown", "shown replays of-shown.mcap")
        tab.click("replay-toggle-shown")
        tab.wait_text("replay-shown", "paused")
        assert status()["paused"] is True
        before = status()["published"]
        tab.click("replay-step-shown")
        mesh.until(lambda: status()["published"] == int(str(before)) + 1)
        tab.fill("replay-seek-shown", "0")
        tab.page.keyboard.press("Enter")
        mesh.until(lambda: status()["position_s"] == 0)
        tab.click("replay-toggle-shown")
        mesh.until(lambda: status()["paused"] is False)
        tab.click("replay-stop-shown")
        process.wait(20)
        tab.page.locator('[data-testid="replay-shown"]').wait_for(state="detached")


def test_panel_has_no_serious_finding_of_axe(open_tab, shift: RestClient, mesh: LiveMesh) -> None:
    with replaying(mesh, shift, "axe"):
        for dark in (False, True):
            with open_tab(dark=dark) as tab:
                tab.go("/recordings")
                tab.wait_text("replay-axe", "axe replays")
                tab.page.wait_for_timeout(300)
                assert tab.serious_findings() == []
