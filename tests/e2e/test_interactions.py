"""100 interactions of a simulated person over REST, with and without services that are killed meanwhile."""

from __future__ import annotations

import pytest
from support.interactions import check_recording, essences, expected, interact
from support.whole_mesh import LiveMesh

PACKAGES = ("monitor", "decider", "learner", "recorder", "gateway", "runtime.router")
KILLED_AT = (20, 40, 60)


def test_a_hundred_interactions_are_a_hundred_of_everything_and_the_decisions_of_the_bare_cores(
    mesh: LiveMesh,
) -> None:
    first, again = interact(mesh, "first", 7), interact(mesh, "again", 7)
    for done in (first, again):
        counts = done.ended["counts"]
        assert (counts["decision"], counts["performance"], counts["transition"]) == (100, 100, 100)
        check_recording(mesh, done)
    assert essences(first) == essences(again) == expected(7)


def test_another_seed_gives_another_session(mesh: LiveMesh) -> None:
    done = interact(mesh, "other", 8, episodes=20)
    assert essences(done) == expected(8, 20)
    assert [d["strategy"] for d in done.decisions] != [d["strategy"] for d in expected(7, 20)]


@pytest.mark.parametrize("package", PACKAGES)
def test_kill_9_changes_neither_decisions_nor_counts(mesh: LiveMesh, package: str) -> None:
    killed = []

    def kill(n: int) -> None:
        if n in KILLED_AT:
            killed.append(mesh.kill(f"shift_{package}"))

    done = interact(mesh, f"killed-{package.replace('.', '-')}", 7, after=kill)
    assert len(set(killed)) == len(KILLED_AT)
    assert essences(done) == expected(7)
    check_recording(mesh, done)
    assert done.ended["counts"]["decision"] == 100
    mesh.wait_ready()


@pytest.mark.parametrize("package", ["recorder", "monitor", "gateway", "runtime.router"])
def test_kill_9_while_the_session_ends_leaves_a_whole_recording(mesh: LiveMesh, package: str) -> None:
    """The end itself is asked for again until it is answered, and is carried out once."""
    session = f"ended-{package.replace('.', '-')}"

    def kill(n: int) -> None:
        if n == 10:
            mesh.kill(f"shift_{package}")

    done = interact(mesh, session, 5, episodes=10, after=kill)
    assert essences(done) == expected(5, 10)
    check_recording(mesh, done)
    mesh.wait_ready()
