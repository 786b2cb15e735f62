"""Make the pictures of the web page in ``docs/images``: each view, light and dark, 1280 and 1920 pixels wide.

It runs a mesh with a simulated tracker for about a minute, so that the room view has something to show. Needs Chromium.

    python docs/make_screenshots.py
"""

from __future__ import annotations

import random
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import httpx
from PIL import Image
from rich.console import Console
from rich.progress import track

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.browser import chromium, opened_tab
from support.whole_mesh import running_mesh

IMAGES = Path(__file__).parent / "images"
FEED_S = 75
CHUNK, RATE_HZ = 15, 120
VIEWS = {
    "start": "/", "room": "/session/p07-lamp", "desk": "/session/p07-lamp/desk", "recordings": "/recordings",
    "recording": "/recordings/p06-lamp.mcap", "study": "/study/lamp", "evaluation": "/evaluation",
}  # fmt: skip
LONG = {"desk", "recording", "study"}
"""Views that are longer than a screen."""
STUDY = """study: lamp
title: Assembling a lamp with a robot
interactions: 24
tasks: [grasp, turn, place]
aois:
  - {name: robot, rectangle: [0.0, 0.0, 0.3, 1.0]}
  - {name: lamp, rectangle: [0.36, 0.15, 0.72, 0.9]}
  - {name: tools, rectangle: [0.76, 0.4, 1.0, 1.0]}
conditions: {scoring: {learner: {name: scoring}}, adaptive: {}}
"""


class Tracker(threading.Thread):
    """Sends gaze at 120 Hz in real time, and asks for a decision every five seconds."""

    def __init__(self, url: str, session: str, speed: float = 1.0) -> None:
        super().__init__(daemon=True)
        self._http = httpx.Client(base_url=url, timeout=30)
        self._session, self._speed = session, speed
        self._draw = random.Random(session)
        self.ended = threading.Event()

    def run(self) -> None:
        """Send until :attr:`ended`."""
        begun, target = time.monotonic(), (0.5, 0.5)
        for seq in range(10**9):
            if self.ended.is_set():
                return
            if self._draw.random() < 0.1:
                target = (self._draw.random(), self._draw.random())
            self._send(seq, target, lost=seq % 150 > 138)
            if seq % 40 == 20:
                self._interact()
            time.sleep(max(0.0, begun + (seq + 1) * CHUNK / RATE_HZ / self._speed - time.monotonic()))

    def _send(self, seq: int, target: tuple[float, float], lost: bool) -> None:
        jitter = [(self._draw.gauss(0, 0.004), self._draw.gauss(0, 0.004)) for _ in range(CHUNK)]
        self._post("gaze", {
            "source": "tx300", "seq": seq, "t": [(seq * CHUNK + i) / RATE_HZ for i in range(CHUNK)],
            "x": [min(max(target[0] + dx, 0), 1) for dx, _ in jitter],
            "y": [min(max(target[1] + dy, 0), 1) for _, dy in jitter],
            "valid": [not lost and self._draw.random() > 0.03 for _ in range(CHUNK)],
        })  # fmt: skip

    def _interact(self) -> None:
        decision = self._post("decisions", {"task": self._draw.choice(["grasp", "turn", "place"])})
        result = {"success": self._draw.random() < 0.6, "duration_s": 5.0}
        self._post(
            "performance", {"decision_id": decision["decision_id"], "comprehension": result, "enabledness": result}
        )

    def _post(self, path: str, body: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = self._http.post(f"/v1/sessions/{self._session}/{path}", json=body).json()
        return answer


def session(http: httpx.Client, participant: str, name: str) -> None:
    """Start a session of the study."""
    body = {"participant": participant, "session": name, "study": "lamp", "condition": "adaptive", "seed": 7}
    http.post("/v1/sessions", json=body).raise_for_status()


def main() -> None:
    """Make all pictures."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, running_mesh(Path(folder)) as mesh, chromium() as browser:
        (mesh.data / "studies" / "lamp.yaml").write_text(STUDY)
        http = httpx.Client(base_url=mesh.url, timeout=30)
        session(http, "P06", "p06-lamp")
        earlier = Tracker(mesh.url, "p06-lamp", speed=4)
        earlier.start()
        session(http, "P07", "p07-lamp")
        tracker = Tracker(mesh.url, "p07-lamp")
        tracker.start()
        for _ in track(range(FEED_S), "a session", console=Console(stderr=True)):
            time.sleep(1)
        earlier.ended.set()
        earlier.join()
        http.post("/v1/sessions/p06-lamp/markers", json={"text": "the phone rang", "author": "Anna"}).raise_for_status()
        http.post("/v1/sessions/p06-lamp/end").raise_for_status()
        http.patch("/v1/sessions/p07-lamp/config?author=Anna", json={"reward": {"scale": 0.8}}).raise_for_status()
        for name, path in track(VIEWS.items(), "pictures", console=Console(stderr=True)):
            for dark in (False, True):
                for width, height in ((1280, 800), (1920, 1080)):
                    with opened_tab(browser, mesh.url, dark, width, height) as tab:
                        tab.go(path)
                        if name == "evaluation":
                            tab.click("evaluation-run")
                            tab.wait_text("evaluation-state", "Done")
                        tab.page.wait_for_timeout(6000 if name == "recording" else 2500)
                        file = IMAGES / f"{name}-{'dark' if dark else 'light'}-{width}.png"
                        tab.page.screenshot(path=file, full_page=name in LONG)
                        Image.open(file).convert("P", palette=Image.Palette.ADAPTIVE, colors=96).save(
                            file, optimize=True
                        )
        tracker.ended.set()
        tracker.join()


if __name__ == "__main__":
    main()
