"""The Gymnasium environment fulfils Gymnasium's contract and simulates the same partners as the simulation."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="an optional extra")

import shift_simulator.env  # noqa: E402, F401
from gymnasium.utils.env_checker import check_env  # noqa: E402
from shift_simulator import ENV_ID  # noqa: E402
from shift_simulator.optimum import optimum  # noqa: E402
from shift_simulator.users import paper_user  # noqa: E402
from shift_study.study import Study  # noqa: E402


@pytest.mark.parametrize("user", ["A", "B", "C", "D"])
@pytest.mark.parametrize("observation", ["states", "triples"])
def test_environment_passes_the_checker_of_gymnasium(user: str, observation: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(gymnasium.make(ENV_ID, user=user, observation=observation).unwrapped)


def test_following_the_suggestion_is_nearly_optimal_with_user_a() -> None:
    env = gymnasium.make(ENV_ID, user="A", observation="states")
    totals = []
    for seed in range(30):
        state, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            state, reward, _, over, _ = env.step(state)
            total += reward
        totals.append(total)
    assert np.mean(totals) == pytest.approx(optimum(paper_user("A"), Study(study="s"), 100), abs=1.5)


def test_importing_the_package_after_gymnasium_registers_the_environment() -> None:
    program = "import gymnasium, shift_simulator; gymnasium.make('shift/Partner-v0', user='B').reset(seed=1)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_same_seed_gives_the_same_session() -> None:
    def session() -> list[tuple[int, float]]:
        env = gymnasium.make(ENV_ID, user="B")
        env.reset(seed=3)
        return [(int(o), r) for o, r, *_ in (env.step(n % 6) for n in range(100))]

    assert session() == session()
