"""What an interaction costs at the end of a long session, beside what it costs at its beginning.

One session runs through the cores of all services, without a network: gaze, a decision and its report. As the services
do after each turn, every state that changed is dumped for its journal. The reference is the first hundred interactions
of the same session, in the same run.

    python benchmarks/growth.py
    python benchmarks/growth.py --interactions 10000 --learner q-learning ucb1
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table
from shift_decider import core as decider
from shift_learner import core as learner_core
from shift_learner.learners import LEARNERS
from shift_monitor import core as monitor
from shift_recorder import core as recorder

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.verify_sessions import Session

DUMPS: dict[str, Callable[[Any], str]] = {
    "recorder": recorder.dump, "monitor": monitor.dump, "decider": decider.dump, "learner": learner_core.dump,
}  # fmt: skip
WINDOW = 100


def interaction_s(session: Session, n: int) -> float:
    """Return the processor time of interaction ``n``, with the dump of each state that changed, in seconds."""
    before = dict(session.states)
    begun = time.process_time()
    session.gaze()
    session.decide(n, timed_out=False)
    session.report(n)
    session.deliver()
    for service, state in session.states.items():
        if state is not before[service]:
            DUMPS[service](state)
    return time.process_time() - begun


def measure(learner: str, interactions: int) -> tuple[float, float, float]:
    """Return the medians of the first and of the last hundred interactions, ms, and the ratio of the two."""
    session = Session({"learner": {"name": learner}}, seed=1)
    session.deliver()
    times = []
    for n in track(range(1, interactions + 1), learner, console=Console(stderr=True)):
        times.append(1000 * interaction_s(session, n))
        session.unrecorded = {owner: type(queue)() for owner, queue in session.unrecorded.items()}
    first, last = statistics.median(times[:WINDOW]), statistics.median(times[-WINDOW:])
    return first, last, last / first


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interactions", type=int, default=2000, help="The length of the session.")
    parser.add_argument("--learner", nargs="+", default=sorted(LEARNERS), help="Which learners.")
    options = parser.parse_args()
    table = Table("learner", "first 100", f"100 before {options.interactions}", "ratio")
    for learner in options.learner:
        first, last, ratio = measure(learner, options.interactions)
        table.add_row(learner, f"{first:.2f} ms", f"{last:.2f} ms", f"{ratio:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
