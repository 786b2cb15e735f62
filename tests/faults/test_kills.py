"""Services are killed with kill -9 at any moment; every interaction counts once, and the sequences are 1..N."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator

import pytest
from shift_runtime.rest_client import RestClient
from shift_verify.verify import verify
from support.interactions import check_recording, essences, expected, interact
from support.whole_mesh import LiveMesh, running_mesh

WORKERS = ("shift_monitor", "shift_decider", "shift_learner")
ALL = (*WORKERS, "shift_recorder", "shift_gateway", "shift_runtime.router")


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("killed")) as running:
        yield running


class Killer(threading.Thread):
    """Kills one of ``packages`` now and then; a package that is away already is passed over."""

    def __init__(self, mesh: LiveMesh, packages: tuple[str, ...], seed: int, most: int) -> None:
        super().__init__(daemon=True)
        self.mesh, self.packages, self.most = mesh, packages, most
        self.rng = random.Random(seed)
        self.killed: list[str] = []
        self.enough = threading.Event()

    def run(self) -> None:
        while len(self.killed) < self.most and not self.enough.wait(self.rng.uniform(0.02, 0.5)):
            package = self.rng.choice(self.packages)
            try:
                self.mesh.kill(package)
            except (AssertionError, ProcessLookupError):
                continue
            self.killed.append(package)


def under_fire(mesh: LiveMesh, session: str, packages: tuple[str, ...], seed: int, episodes: int, most: int) -> None:
    killer = Killer(mesh, packages, seed, most)
    killer.start()
    try:
        done = interact(mesh, session, seed, episodes)
    finally:
        killer.enough.set()
        killer.join(30)
    assert killer.killed
    assert essences(done) == expected(seed, episodes), killer.killed
    check_recording(mesh, done)
    mesh.wait_ready()


def test_row_1_monitor_decider_and_learner_die_again_and_again(mesh: LiveMesh) -> None:
    under_fire(mesh, "row-1", WORKERS, 11, 60, 5)


def test_row_2_the_router_dies_and_who_starts_meanwhile_waits_for_it(mesh: LiveMesh) -> None:
    """A service that dies with the router comes back first and finds nobody; both are there in the end."""

    def kill(n: int) -> None:
        if n in (5, 10, 15):
            mesh.wait_ready()
            mesh.kill("shift_runtime.router")
            mesh.kill(WORKERS[n // 5 - 1])

    done = interact(mesh, "row-2", 12, 20, after=kill)
    assert essences(done) == expected(12, 20)
    check_recording(mesh, done)
    mesh.wait_ready()


def test_row_3_the_recorder_dies_and_misses_nothing(mesh: LiveMesh) -> None:
    under_fire(mesh, "row-3", ("shift_recorder",), 13, 40, 3)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_row_4_any_of_them_at_any_moment(mesh: LiveMesh, seed: int) -> None:
    under_fire(mesh, f"row-4-{seed}", ALL, seed, 40, 5)


def test_the_recorder_dies_at_twelve_moments_of_an_end_and_every_recording_verifies(mesh: LiveMesh) -> None:
    """The end goes on where it was, once, though it is asked for again meanwhile."""
    for delay_ms in (0, 5, 10, 15, 20, 30, 40, 50, 60, 75, 90, 120):
        session = f"end-{delay_ms}"
        killer = threading.Timer(delay_ms / 1000, mesh.kill, ("shift_recorder",))

        def last(n: int, killer: threading.Timer = killer) -> None:
            if n == 5:
                killer.start()

        done = interact(mesh, session, 21, 5, after=last)
        killer.join()
        assert essences(done) == expected(21, 5)
        check_recording(mesh, done)
        report = verify(mesh.data / "recordings" / f"{session}.mcap")
        assert (report.ok, report.complete, report.checksum) == (True, True, "matches"), report.difference
        with RestClient(mesh.url, patience_s=60.0) as shift:
            assert shift.end(session) == done.ended
    mesh.wait_ready()
