"""``shift-mesh gaze play``: a recording gives the same partner model at any speed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from shift_runtime.rest_client import RestClient
from support.interactions import read_recording
from support.whole_mesh import LiveMesh

GAZE = Path(__file__).parents[1] / "data" / "gaze"
FILES = sorted(GAZE.glob("*.tsv.gz"))
SHORTEST = min(FILES, key=lambda f: f.stat().st_size)
STUDY = {
    "study": "gaze",
    "aois": [
        {"name": "left", "rectangle": [0.0, 0.0, 0.4, 1.0]},
        {"name": "middle", "rectangle": [0.4, 0.0, 0.6, 1.0]},
        {"name": "right", "rectangle": [0.6, 0.0, 1.0, 1.0]},
    ],
}


def command(mesh: LiveMesh, file: Path, session: str, *flags: str) -> subprocess.Popen[str]:
    line = [sys.executable, "-m", "shift_cli.main", "gaze", "play", str(file), "--session", session, "--url", mesh.url]
    return subprocess.Popen([*line, *flags], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def played(mesh: LiveMesh, file: Path, speeds: tuple[float, ...]) -> list[dict[str, object]]:
    """Return the partner model's gaze after the file at each speed; the sessions run at the same time."""
    name = file.name.split(".")[0]
    with RestClient(mesh.url) as shift:
        running = []
        for speed in speeds:
            session = f"{name}-{speed:g}x"
            shift.start("P00", session=session, study=STUDY)
            running.append((session, command(mesh, file, session, "--speed", str(speed))))
        found = []
        for session, process in running:
            _, said = process.communicate(timeout=120)
            assert process.returncode == 0, said
            assert f"into session {session}" in said
            found.append(shift.observation(session)["gaze"])
            shift.end(session)
    return found


@pytest.mark.parametrize(
    ("file", "speeds"),
    [(file, (20.0, 50.0, 5.0) if file == SHORTEST else (20.0, 50.0)) for file in FILES],
    ids=[file.name.split(".")[0] for file in FILES],
)
def test_the_same_recording_gives_the_same_weights_and_class_at_every_speed(
    mesh: LiveMesh, file: Path, speeds: tuple[float, ...]
) -> None:
    first, *others = played(mesh, file, speeds)
    assert first["fixations"] > 5
    for other in others:
        assert other["category"] == first["category"]
        assert other["weights"] == pytest.approx(first["weights"], abs=1e-9)
        assert other["focus_shift"] == pytest.approx(first["focus_shift"], abs=1e-9)
        assert (other["fixations"], other["aoi"], other["dropped"]) == (first["fixations"], first["aoi"], 0)
    name = file.name.split(".")[0]
    kept = [read_recording(mesh.data / "recordings" / f"{name}-{speed:g}x.mcap") for speed in speeds]
    samples = [[(t, x, y) for g in r["gaze"] for t, x, y in zip(g["t"], g["x"], g["y"], strict=True)] for r in kept]
    assert all(s == samples[0] for s in samples)
    without = ("session", "stamp", "seen", "source")
    fixations = [[{k: v for k, v in f.items() if k not in without} for f in r["fixation"]] for r in kept]
    assert all(f == fixations[0] for f in fixations)


def test_what_cannot_be_played_is_said_in_a_sentence(mesh: LiveMesh, tmp_path: Path) -> None:
    (tmp_path / "empty.tsv").write_text("")
    (tmp_path / "folder").mkdir()
    for file, session in (
        (tmp_path / "nothing.tsv", "s1"),
        (tmp_path / "empty.tsv", "s1"),
        (tmp_path / "folder", "s1"),
        (SHORTEST, "no-such-session"),
        (SHORTEST, "../s1"),
    ):
        process = command(mesh, file, session, "--speed", "1000")
        _, said = process.communicate(timeout=60)
        assert process.returncode == 2, said
        assert "Traceback" not in said
        assert said.strip()


def table(path: Path, x: float, n: int = 300) -> Path:
    """Write a Titta table of one second at 300 Hz with both eyes at ``x``, 0.5; -1 means lost."""
    point = "gaze_point_on_display_area"
    header = ["device_time_stamp"]
    for eye in ("left", "right"):
        header += [f"{eye}_{point}_x", f"{eye}_{point}_y", f"{eye}_gaze_point_valid"]
    valid = "0" if x == -1.0 else "1"
    rows = [[str(1_000_000 + i * 3333), *[str(x), "0.5", valid] * 2] for i in range(n)]
    path.write_text("\n".join("\t".join(row) for row in [header, *rows]) + "\n")
    return path


def test_gaze_of_which_nothing_counts_ends_with_exit_code_1_and_says_why(mesh: LiveMesh, tmp_path: Path) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P00", session="counts", study=STUDY)
    good = table(tmp_path / "good.tsv", 0.1)
    for file, flags, code, words in (
        (good, ("--source", "eyes"), 0, "300 samples at 300 Hz, 1.0 s of gaze, lost 0.0%"),
        (good, ("--source", "eyes"), 1, "the session had all of it already"),
        (table(tmp_path / "other.tsv", 0.9), ("--source", "eyes"), 0, "segment 1 of the source begins"),
        (table(tmp_path / "lost.tsv", -1.0), (), 1, "every sample is lost"),
        (table(tmp_path / "off.tsv", 1.5), (), 1, "off the stimulus 100.0%"),
        (good, ("--source", "P 01"), 2, "for example P-01"),
    ):
        process = command(mesh, file, "counts", "--rate", "100", *flags)
        _, said = process.communicate(timeout=60)
        assert (process.returncode, "Traceback" in said) == (code, False), said
        assert words in " ".join(said.split()), said
