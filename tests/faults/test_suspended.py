"""A process that was suspended (a laptop's lid, a paused virtual machine) comes back with all its links.

A few of the cases; ``make campaign-suspend`` does each of the six processes for 2, 12 and 30 s, several times.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from support.free_ports import free_port
from support.suspension import begin, check, suspend
from support.whole_mesh import LiveMesh, running_mesh


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("suspended")) as running:
        yield running


@pytest.mark.parametrize(
    ("process", "stopped_s"),
    [
        ("shift_monitor", 12.0), ("shift_recorder", 12.0), ("shift_runtime.router", 12.0), ("shift_gateway", 12.0),
        ("shift_decider", 2.0),
    ],
)  # fmt: skip
def test_after_a_suspension_everything_works_again_and_nothing_answered_is_lost(
    mesh: LiveMesh, process: str, stopped_s: float
) -> None:
    traffic = begin(mesh, f"{process.rsplit('_', 1)[-1].replace('.', '-')}-{stopped_s:.0f}")
    found = suspend(mesh, process, traffic.session, stopped_s)
    check(mesh, traffic)
    if process not in ("shift_runtime.router", "shift_gateway") and stopped_s > 5:
        name = process.removeprefix("shift_")
        assert f"{name}: does not answer" in found.said
        assert any(said.endswith(f"does not reach the {name}") for said in found.said)


def test_a_link_that_is_gone_is_counted(mesh: LiveMesh) -> None:
    text = httpx.get(f"{mesh.url}/metrics", timeout=10.0).text
    assert 'shift_links_lost_total{owner="recorder",service="monitor"}' in text
    assert 'shift_owner_silent_seconds{owner="monitor",service="gateway"}' in text


def test_a_second_mesh_on_the_same_router_refuses_to_start_and_says_why(mesh: LiveMesh, tmp_path: Path) -> None:
    line = [
        sys.executable, "-m", "shift_cli.main", "up", "--port", str(free_port()), "--data", str(tmp_path / "data"),
        "--router", mesh.zenoh, "--zenoh", mesh.zenoh,
    ]  # fmt: skip
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "answers on this router already, with the data folder" in " ".join(done.stderr.split())
    assert str(mesh.data) in done.stderr.replace("\n", "")
    assert "found another mesh on its router; stopping" in " ".join(done.stderr.split())
    mesh.wait_ready()
