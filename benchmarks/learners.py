"""Measure the time of a planner's decision: live (one session, the whole policy) and in simulation (batched runs).

    python benchmarks/learners.py [--runs 1000] [--families 20]

With ``--families``, print instead the mean rewards of learners with that many users of each generated family
(docs/learners.md).

A live decision has the updates after the decision and after the reward, each with the 30 rows of the policy. The exit
code is 1 if the median is 2 ms or more live, or 0.2 ms or more in simulation.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time

import numpy as np
from shift_learner.learner import Context, Taken
from shift_learner.learners import learner_named
from shift_simulator.batched_learners import batch_learner
from shift_simulator.batched_sessions import simulate
from shift_simulator.compare import rewards_of
from shift_simulator.generated_users import FAMILIES
from shift_simulator.optimum import optimum
from shift_simulator.random_streams import session_seeds
from shift_simulator.users import PAPER_USERS, paper_user
from shift_study.study import Study

LIVE_MS, SIMULATED_MS = 2.0, 0.2


def live(name: str, interactions: int = 100) -> tuple[list[float], int]:
    """Return the milliseconds of each decision in a simulated session, and the final size of the memory in bytes."""
    context = Context(Study.model_validate({"study": "s", "learner": {"name": name}}))
    learner, memory = learner_named(name), learner_named(name).initial(context)
    trace = simulate(paper_user("B"), context.study, batch_learner(context, 1), session_seeds(1, 1), interactions)
    times = []
    for n in range(interactions):
        triple, action = int(trace.triple[n, 0]), int(trace.action[n, 0])
        taken = Taken(n + 1, triple, context.suggestions[triple], action, 1.0)
        begin = time.perf_counter()
        memory = learner.on_decision(context, memory, taken)
        for state in range(30):
            learner.row(context, memory, state)
        memory = learner.on_reward(context, memory, taken, float(trace.reward[n, 0]), None)
        for state in range(30):
            learner.row(context, memory, state)
        times.append((time.perf_counter() - begin) * 1e3)
    return times, len(json.dumps(learner.dump(memory)))


def main() -> int:
    """Measure and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--families", type=int, default=0)
    options = parser.parse_args()
    return families(options.families) if options.families else speed(options.runs)


def families(people: int, runs: int = 32) -> int:
    """Print the mean reward of each learner with ``people`` users of each family, and their mean exact optimum."""
    for name, family in FAMILIES.items():
        users = [family(np.random.default_rng([2026, i])) for i in range(people)]
        best = np.mean([optimum(user, Study(study="s"), 100) for user in users])
        rewards = {
            learner: [rewards_of(learner, user, i, runs)[-1].mean() for i, user in enumerate(users)]
            for learner in ("planner", "q-learning", "scoring")
        }
        means = "   ".join(f"{k} {np.mean(v):6.1f} +- {np.std(v) / people**0.5:.1f}" for k, v in rewards.items())
        print(f"{name:26}{means}   optimum {best:.1f}", flush=True)
    return 0


def speed(runs: int) -> int:
    """Print the speed and the reward of the planner; return the exit code."""
    simulated = []
    for user in PAPER_USERS:
        begin = time.process_time()
        rewards = rewards_of("planner", paper_user(user), 1, runs)[-1]
        simulated.append((time.process_time() - begin) / runs / 100 * 1e3)
        error = rewards.std() / runs**0.5
        print(f"user {user}   R {rewards.mean():6.2f} +- {error:.2f}   {simulated[-1]:.3f} ms a decision", flush=True)
    times, size = live("planner")
    print(f"live     {statistics.median(times):.2f} ms a decision ({min(times):.2f} to {max(times):.2f}); {size} bytes")
    return int(statistics.median(times) >= LIVE_MS or statistics.median(simulated) >= SIMULATED_MS)


if __name__ == "__main__":
    sys.exit(main())
