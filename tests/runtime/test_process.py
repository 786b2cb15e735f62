"""A service as a process: what its user reads when it cannot start."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from shift_runtime.journal import Journal
from shift_runtime.journal_schema import MIGRATIONS
from support.runtime_fixtures import free_endpoint

NEWER = len(MIGRATIONS) + 1


@pytest.fixture
def newer_folder(tmp_path: Path) -> Path:
    """Return a data folder whose journals are of a newer version."""
    for name in ("recorder", "monitor"):
        path = tmp_path / "state" / f"{name}.sqlite"
        Journal(path, name).close()
        with closing(sqlite3.connect(path)) as db:
            db.execute(f"PRAGMA user_version = {NEWER}")
    return tmp_path


def run(*arguments: str, data: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "SHIFT_DATA": str(data), "SHIFT_ZENOH": free_endpoint()}
    return subprocess.run(
        [sys.executable, "-m", *arguments], env=environment, capture_output=True, text=True, timeout=120
    )


@pytest.mark.parametrize("whole_mesh", [False, True], ids=["service", "whole mesh"])
def test_newer_data_folder_is_refused_in_one_line(newer_folder: Path, whole_mesh: bool) -> None:
    port = free_endpoint().rpartition(":")[2]
    up = ["shift_cli.main", "up", "--data", str(newer_folder), "--zenoh", free_endpoint(), "--port", port]
    done = run(*(up if whole_mesh else ["shift_monitor"]), data=newer_folder)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert f"the data folder {newer_folder} was written by a newer shift-mesh" in line
    assert f"its journal monitor.sqlite has schema version {NEWER}, and this shift-mesh reads versions up to" in line
    assert line.endswith("start the newer shift-mesh, or use another data folder (--data or SHIFT_DATA)")
