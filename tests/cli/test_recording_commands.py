"""``verify``, ``info`` and ``export`` on the command line: what they print, and their exit codes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from shift_cli.main import app
from shift_schemas.errors import InvalidSettings
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


# --- export ---


def test_export_writes_the_tables_of_every_recording_of_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("points.mcap", "names-coffee.mcap"):
        shutil.copy(KEPT / name, folder)
    done = CliRunner().invoke(app, ["export", str(folder), "--to", "csv", "--out", str(tmp_path / "out"), "--json"])
    found = json.loads(done.stdout)
    assert done.exit_code == 0
    assert sorted(found["recordings"]) == ["names-coffee.mcap", "points.mcap"]
    assert found["rows"]["gaze"] >= 360
    assert all(Path(path).is_file() for path in found["files"])


def test_export_of_a_damaged_recording_says_so_and_ends_with_1(tmp_path: Path) -> None:
    changed = tmp_path / "points.mcap"
    data = bytearray((KEPT / "points.mcap").read_bytes())
    data[len(data) // 2] ^= 0x10
    changed.write_bytes(bytes(data))
    done = CliRunner().invoke(app, ["export", str(changed), "--to", "vw", "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert "points.mcap is damaged" in done.stderr


@pytest.mark.parametrize("screen", ["", "1920", "0x1080", "wide"])
def test_export_to_bids_needs_a_screen(tmp_path: Path, screen: str) -> None:
    line = ["export", str(KEPT / "points.mcap"), "--to", "bids", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*line, *(["--screen", screen] if screen else [])])
    assert done.exit_code != 0
    assert isinstance(done.exception, InvalidSettings)
    assert "1920x1080" in done.exception.detail


# --- several recordings ---


def test_folder_is_verified_and_described_in_a_report(tmp_path: Path) -> None:
    report = tmp_path / "report.md"
    line = ["verify", str(KEPT), "--report", str(report), "--workers", "2", "--json"]
    found = json.loads(CliRunner().invoke(app, line).stdout)
    assert (found["recordings"], found["ok"], found["complete"]) == (10, 10, 10)
    assert {each["file"] for each in found["reports"]} == {path.name for path in KEPT.glob("*.mcap")}
    assert report.read_text().startswith("# Verification of 10 recordings")


def test_one_damaged_recording_makes_the_exit_code_1(tmp_path: Path) -> None:
    for name in ("points.mcap", "late.mcap"):
        shutil.copy(KEPT / name, tmp_path)
    (tmp_path / "late.mcap").write_bytes(b"nothing")
    done = CliRunner().invoke(app, ["verify", str(tmp_path), "--workers", "1"])
    assert done.exit_code == 1
    assert "1 of 2 recordings have no difference" in done.stdout


# --- recover and convert ---


def test_recover_reports_what_was_lost_and_ends_with_1(tmp_path: Path) -> None:
    cut = tmp_path / "points.mcap"
    cut.write_bytes((KEPT / "points.mcap").read_bytes()[:-2000])
    done = CliRunner().invoke(app, ["recover", str(cut), "--out", str(tmp_path / "out"), "--json"])
    (found,) = json.loads(done.stdout)["files"]
    assert done.exit_code == 1
    assert set(found) >= {"name", "complete", "messages", "lost_bytes", "written"}
    assert (found["name"], found["complete"]) == ("points.mcap", False)
    assert CliRunner().invoke(app, ["info", found["written"]]).exit_code == 0


def test_convert_keeps_the_topics_and_the_times(tmp_path: Path) -> None:
    out = tmp_path / "decisions.mcap"
    line = ["convert", str(KEPT / "points.mcap"), "--out", str(out), "--topics", "decision, performance", "--json"]
    done = CliRunner().invoke(app, line)
    assert done.exit_code == 0
    assert json.loads(done.stdout)["files"][0]["messages"] == 8
    counts = json.loads(CliRunner().invoke(app, ["info", str(out), "--json"]).stdout)["counts"]
    assert counts == {"decision": 4, "performance": 4}


def test_convert_refuses_an_end_before_the_start(tmp_path: Path) -> None:
    line = ["convert", str(KEPT / "points.mcap"), "--out", str(tmp_path / "x.mcap"), "--start", "5", "--end", "1"]
    done = CliRunner().invoke(app, line)
    assert isinstance(done.exception, InvalidSettings)
    assert "must not be before" in done.exception.detail
