"""A real Dask scheduler with two workers gives what the cores of this machine give, to the last digit."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from shift_analysis.robustness import robustness
from shift_analysis.whatif import OtherPolicy, compare_recordings, what_if
from shift_recording.export.export import Way, export
from shift_recording.parallel import for_each
from shift_schemas.errors import Unavailable
from shift_simulator.compare import compare
from shift_simulator.user_study import users
from shift_simulator.users import paper_user
from shift_verify.many import report_on_many
from support.verify_sessions import Session

pytestmark = pytest.mark.timeout(180)
KEPT = sorted((Path(__file__).parents[1] / "data" / "v0.2").glob("*.mcap"))
STARTED_WITHIN_S = 60


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A scheduler and two workers on loopback; yield the scheduler's address."""
    folder = tmp_path_factory.mktemp("dask")
    log = folder / "scheduler.log"
    quiet = {**os.environ, "DASK_DISTRIBUTED__SCHEDULER__DASHBOARD__STATUS__TASK_STREAM_LENGTH": "1"}
    with open(log, "wb") as output:
        first = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
        processes = [subprocess.Popen([*first, "--no-dashboard"], stdout=output, stderr=output, env=quiet)]
        try:
            address = _address(log)
            worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--host", "127.0.0.1"]
            options = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(folder)]
            processes += [
                subprocess.Popen([*worker, *options], stdout=output, stderr=output, env=quiet) for _ in range(2)
            ]
            yield address
        finally:
            for process in reversed(processes):
                process.send_signal(signal.SIGTERM)
            for process in processes:
                process.wait(30)


def _address(log: Path) -> str:
    end = time.monotonic() + STARTED_WITHIN_S
    while not (found := re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text())):
        assert time.monotonic() < end, log.read_text()
        time.sleep(0.05)
    return found[0]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    paths = []
    for seed in range(3):
        folder = tmp_path_factory.mktemp(f"recording{seed}")
        paths.append(Session(seed=seed).interactions(15).ended().finished(folder))
    damaged = tmp_path_factory.mktemp("damaged") / "damaged.mcap"
    damaged.write_bytes(paths[0].read_bytes()[:2000])
    return [*paths, damaged]


def test_results_of_the_cluster_are_the_same(scheduler: str, recordings: list[Path]) -> None:
    policy = OtherPolicy(learner="thompson")
    here = what_if(compare_recordings(recordings, policy, workers=1)).as_json()
    there = what_if(compare_recordings(recordings, policy, scheduler=scheduler)).as_json()
    assert there == here
    assert list(robustness(recordings, scheduler=scheduler)) == list(robustness(recordings, workers=1))
    assert list(report_on_many(recordings, scheduler=scheduler)) == list(report_on_many(recordings, workers=2))


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_exported_tables_are_the_same(scheduler: str, tmp_path: Path, to: Literal["csv", "parquet"]) -> None:
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(KEPT[0].read_bytes()[:3000])
    paths = [*KEPT[1:4], damaged]
    ways = {"one": Way(1), "two": Way(2), "cluster": Way(scheduler=scheduler)}
    done = {name: export(paths, to, tmp_path / name, way=way) for name, way in ways.items()}
    for name in ("two", "cluster"):
        assert done[name].rows == done["one"].rows
        assert done[name].report == done["one"].report
        for file in done["one"].files:
            assert (tmp_path / name / file.name).read_bytes() == file.read_bytes(), file.name
    assert not list(tmp_path.glob("*/.parts*"))


def test_evaluation_is_the_same(scheduler: str) -> None:
    people = [paper_user("A"), paper_user("B")]
    given = (["scoring", "thompson"], people, 3, 20, False, lambda text: None)
    here = compare(*given)
    assert compare(*given, workers=2) == here
    assert compare(*given, scheduler=scheduler) == here
    assert users(3, 20, scheduler=scheduler) == users(3, 20)


def test_work_is_done_by_both_workers(scheduler: str) -> None:
    slow_pid = "(__import__('time').sleep(0.2), __import__('os').getpid())[1]"  # the workers do not have this module
    assert len(set(for_each(eval, [slow_pid] * 8, scheduler=scheduler))) == 2


def test_scheduler_that_is_not_there_is_named() -> None:
    with pytest.raises(Unavailable, match=r"tcp://127\.0\.0\.1:9 does not answer"):
        list(for_each(len, ["a", "b"], scheduler="tcp://127.0.0.1:9"))
