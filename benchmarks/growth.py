"""What an interaction costs at the end of a long session, beside what it costs at its beginning.

One session runs through the cores of all services, without a network: gaze, a decision and its report. As the services
do after each turn, every state that changed is committed to a journal. The reference is the first hundred interactions
of the same session, in the same run. Times are processor times.

    python benchmarks/growth.py
    python benchmarks/growth.py --interactions 10000 --learner q-learning ucb1
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table
from shift_decider.service import CORE as DECIDER
from shift_learner.learners import LEARNERS
from shift_learner.service import CORE as LEARNER
from shift_monitor.service import CORE as MONITOR
from shift_recorder.service import CORE as RECORDER
from shift_runtime.journal import Batch, Journal
from shift_runtime.service.core import Core
from shift_runtime.service.states import SessionStates

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.verify_sessions import Session

WINDOW = 100
CORES: tuple[Core[Any], ...] = (RECORDER, MONITOR, DECIDER, LEARNER)


class Kept:
    """The journals of all services; the states of one session are committed to them."""

    def __init__(self, folder: Path) -> None:
        self.journals = {core.name: Journal(folder / f"{core.name}.sqlite", core.name) for core in CORES}
        self.states = {core.name: SessionStates(core, self.journals[core.name]) for core in CORES}

    def commit(self, service: str, state: Any) -> None:
        """Commit a state as the service's worker does."""
        states = self.states[service]
        states.put("s1", state)
        parts = {("s1", name): text for name, text in states.changed_parts("s1").items()}
        self.journals[service].commit(Batch(states={"s1": states.dump("s1")}, parts=parts))
        states.committed("s1")

    def close(self) -> None:
        """Close the journals."""
        for journal in self.journals.values():
            journal.close()


def interaction_s(session: Session, kept: Kept, n: int) -> float:
    """Return the processor time of interaction ``n`` with its commits, in seconds."""
    before = dict(session.states)
    begun = time.process_time()
    session.gaze()
    session.decide(n, timed_out=False)
    session.report(n)
    session.deliver()
    for service, state in session.states.items():
        if state is not before[service]:
            kept.commit(service, state)
    return time.process_time() - begun


def measure(learner: str, interactions: int) -> tuple[float, float, float]:
    """Return the medians of the first and of the last hundred interactions, ms, and the ratio of the two."""
    session = Session({"learner": {"name": learner}}, seed=1)
    session.deliver()
    times = []
    with tempfile.TemporaryDirectory() as folder:
        kept = Kept(Path(folder))
        for n in track(range(1, interactions + 1), learner, console=Console(stderr=True)):
            times.append(1000 * interaction_s(session, kept, n))
            session.unrecorded = {owner: type(queue)() for owner, queue in session.unrecorded.items()}
        kept.close()
    first, last = statistics.median(times[:WINDOW]), statistics.median(times[-WINDOW:])
    return first, last, last / first


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interactions", type=int, default=1000, help="The length of the session.")
    parser.add_argument("--learner", nargs="+", default=sorted(LEARNERS), help="Which learners.")
    options = parser.parse_args()
    table = Table("learner", "first 100", f"last 100 of {options.interactions}", "ratio")
    for learner in options.learner:
        first, last, ratio = measure(learner, options.interactions)
        table.add_row(learner, f"{first:.2f} ms", f"{last:.2f} ms", f"{ratio:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
