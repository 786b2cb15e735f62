"""Suspending a process of a running mesh under traffic, and counting what became of what was answered.

``python tests/support/suspension.py --times 5`` (``make campaign-suspend``) stops each of the six processes for 2, 12
and 30 s, five times each, and prints how long it took until everything worked again, and what ``/readyz`` said
meanwhile.
Used by test_suspended.py, which does a little of it.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from shift_recording.mcap.reader import Recording
from shift_verify.verify import verify

from support.whole_mesh import LiveMesh, running_mesh

PROCESSES = (
    "shift_runtime.router", "shift_recorder", "shift_monitor", "shift_decider", "shift_learner", "shift_gateway",
)  # fmt: skip
DURATIONS_S = (2.0, 12.0, 30.0)
RESULT = {"success": True, "duration_s": 2.0}


@dataclass
class Traffic(threading.Thread):
    """Gaze, decisions and reports in one session; what was answered with 2xx is kept."""

    mesh: LiveMesh
    session: str
    accepted: int = 0
    decisions: set[str] = field(default_factory=set)
    reports: set[str] = field(default_factory=set)
    stopping: bool = False

    def __post_init__(self) -> None:
        super().__init__(daemon=True)

    __hash__ = threading.Thread.__hash__

    def run(self) -> None:
        with httpx.Client(base_url=f"{self.mesh.url}/v1/sessions/{self.session}", timeout=10.0) as http:
            seq = n = 0
            while not self.stopping:
                t = [round(seq * 0.1 + i / 100, 6) for i in range(10)]
                body = {"source": "eyes", "seq": seq, "t": t, "x": [0.2] * 10, "y": [0.5] * 10}
                if (answer := self._sent(http, "gaze", body)) is not None:
                    self.accepted += answer["accepted"]
                    seq += 1
                name = f"d{n}"
                if self._sent(http, "decisions", {"task": "a", "decision_id": name}) is not None:
                    self.decisions.add(name)
                    told = {"decision_id": name, "comprehension": RESULT, "enabledness": RESULT}
                    if self._sent(http, "performance", told) is not None:
                        self.reports.add(name)
                    n += 1
                time.sleep(0.05)

    def _sent(self, http: httpx.Client, path: str, body: dict[str, Any]) -> dict[str, Any] | None:
        try:
            answer = http.post(f"/{path}", json=body)
        except httpx.HTTPError:
            return None
        return answer.json() if answer.is_success else None

    def finish(self) -> None:
        """Return when the last request was answered."""
        self.stopping = True
        self.join(60)
        assert not self.is_alive()


@dataclass(frozen=True)
class Suspension:
    """One process stopped and continued."""

    process: str
    stopped_s: float
    recovery_s: float
    """Until ``/readyz`` was true and a decision was answered, after the process went on."""
    said: tuple[str, ...]
    """What ``/readyz`` named while it was stopped and until all worked again."""


def suspend(mesh: LiveMesh, process: str, session: str, stopped_s: float, patience_s: float = 60.0) -> Suspension:
    """Stop a process, let it go on, and wait until everything works."""
    pid, said = mesh.pid_of(process), dict[str, None]()
    os.kill(pid, signal.SIGSTOP)
    try:
        end = time.monotonic() + stopped_s
        while time.monotonic() < end:
            said |= dict.fromkeys(_faults(mesh))
            time.sleep(0.25)
    finally:
        os.kill(pid, signal.SIGCONT)
    begun = time.monotonic()
    while (faults := _faults(mesh)) or not _decides(mesh, session):
        said |= dict.fromkeys(faults)
        assert time.monotonic() - begun < patience_s, (process, stopped_s, faults, mesh.log.read_text()[-3000:])
        time.sleep(0.05)
    return Suspension(process, stopped_s, time.monotonic() - begun, tuple(said))


def _faults(mesh: LiveMesh) -> list[str]:
    try:
        ready = httpx.get(f"{mesh.url}/readyz", timeout=3.0).json()
    except httpx.HTTPError:
        return ["the gateway does not answer"]
    return [] if ready["ready"] else [*(f"{s}: {ready['services'][s]}" for s in ready["missing"]), *ready["links"]]


def _decides(mesh: LiveMesh, session: str) -> bool:
    try:
        answer = httpx.post(f"{mesh.url}/v1/sessions/{session}/decisions", json={"task": "b"}, timeout=10.0)
    except httpx.HTTPError:
        return False
    return answer.status_code == 201 and answer.json()["policy_source"] == "learner" and not answer.json()["stale"]


def begin(mesh: LiveMesh, session: str) -> Traffic:
    """Begin a session with traffic in it."""
    study = {"study": "suspended", "learner": {"name": "q-learning"}}
    body = {"participant": "P01", "session": session, "study": study, "seed": 7}
    httpx.post(f"{mesh.url}/v1/sessions", json=body, timeout=30.0).raise_for_status()
    traffic = Traffic(mesh, session)
    traffic.start()
    mesh.until(lambda: traffic.reports)
    return traffic


def check(mesh: LiveMesh, traffic: Traffic) -> None:
    """End the session; all that was answered is in its recording, and the recording verifies."""
    traffic.finish()
    answer = httpx.post(f"{mesh.url}/v1/sessions/{traffic.session}/end", timeout=60.0)
    assert answer.status_code == 200, answer.text
    path = mesh.data / "recordings" / f"{traffic.session}.mcap"
    report = verify(path)
    assert (report.ok, report.complete) == (True, True), report.difference
    facts = [recorded.fact for recorded in Recording(path).facts(("gaze", "decision", "performance"))]
    samples = sum(len(fact.t) for fact in facts if fact.subject == "gaze")  # type: ignore[attr-defined]
    assert traffic.accepted > 0
    assert samples >= traffic.accepted
    for subject, answered in (("decision", traffic.decisions), ("performance", traffic.reports)):
        assert answered <= {fact.decision_id for fact in facts if fact.subject == subject}  # type: ignore[attr-defined]


def main() -> int:
    """The long campaign; exit code 1 where something did not work again within 5 s."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--times", type=int, default=5, help="How often each process is stopped for each duration.")
    parser.add_argument("--seconds", type=float, nargs="*", default=list(DURATIONS_S), help="For how long.")
    given = parser.parse_args()
    slow = 0
    with tempfile.TemporaryDirectory() as folder, running_mesh(Path(folder)) as mesh:
        for number, (stopped_s, process) in enumerate((s, p) for s in given.seconds for p in PROCESSES):
            traffic = begin(mesh, f"campaign-{number}")
            found = [suspend(mesh, process, traffic.session, stopped_s) for _ in range(given.times)]
            check(mesh, traffic)
            longest = max(s.recovery_s for s in found)
            slow += sum(s.recovery_s > 5.0 for s in found)
            said = list(dict.fromkeys(text for s in found for text in s.said))
            took = ", ".join(f"{s.recovery_s:.1f}" for s in found)
            counted = f"{traffic.accepted} samples and {len(traffic.decisions)} decisions recorded, verified"
            print(
                f"{process}, {stopped_s:g} s, {given.times} times: works again after {took} s (longest {longest:.1f})"
            )
            print(f"    readyz named: {'; '.join(said) or 'nothing'}\n    {counted}", flush=True)
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
