"""``verify`` and ``info`` on the command line: the last line says whether it is verified, and counts say of what."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from shift_cli.main import app
from typer.testing import CliRunner

KEPT = Path(__file__).parents[1] / "data" / "v0.1"


def last_line(*line: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(line))
    return done.exit_code, done.stdout.strip().splitlines()[-1]


def test_a_whole_recording_is_verified() -> None:
    assert last_line("verify", str(KEPT / "points.mcap")) == (0, "VERIFIED: no difference")


@pytest.mark.parametrize("kind", ["cut", "flipped", "empty"])
def test_a_damaged_recording_is_not_verified(tmp_path: Path, kind: str) -> None:
    data = bytearray((KEPT / "points.mcap").read_bytes())
    if kind == "flipped":
        data[len(data) // 2] ^= 0x10
    changed = tmp_path / "points.mcap"
    changed.write_bytes(b"" if kind == "empty" else bytes(data[:-2000] if kind == "cut" else data))
    shutil.copy(KEPT / "points.mcap.sha256", tmp_path)
    code, line = last_line("verify", str(changed))
    assert code == 1
    assert line.startswith("NOT VERIFIED: ")
    changed.with_name("points.mcap.sha256").unlink()
    code, line = last_line("verify", str(changed))
    assert line.startswith("NOT VERIFIED: " if code else "VERIFIED")
    assert code == 1 or kind != "empty"
    assert CliRunner().invoke(app, ["info", str(changed)]).exit_code == (0 if kind == "cut" else 1)


def test_info_counts_the_samples_beside_the_chunks_and_takes_the_sessions_own_times() -> None:
    done = CliRunner().invoke(app, ["info", str(KEPT / "points.mcap"), "--json"])
    found = json.loads(done.stdout)
    assert (found["counts"]["gaze"], found["gaze_samples"]) == (12, 360)
    assert found["duration_s"] > 0
    said = CliRunner().invoke(app, ["info", str(KEPT / "points.mcap")]).stdout
    assert "12 chunks, 360 samples" in said
