"""Files of several makers leave the weights that the same gaze leaves when it is sent without any reader.

The gaze is a list of pixels that this test makes up. It is sent over REST as 0..1, and written as each maker's file.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from support.interactions import read_recording
from support.whole_mesh import LiveMesh

WIDTH, HEIGHT = 1920, 1080
STEP_MS = 10
STUDY = {
    "study": "formats",
    "aois": [
        {"name": "left", "rectangle": [0.0, 0.0, 0.5, 1.0]},
        {"name": "right", "rectangle": [0.5, 0.0, 1.0, 1.0]},
    ],
}
Pixels = list[tuple[int, int] | None]
GAZE: Pixels = [
    None if i % 50 == 7 else (300 + i % 3, 500) if i // 60 % 3 else (1500, 400 + i % 2) for i in range(400)
]  # fmt: skip


def tobii(gaze: Pixels) -> str:
    rows = [f"{i * STEP_MS}\tAda\t{p[0]}\t{p[1]}" if p else f"{i * STEP_MS}\tAda\t\t" for i, p in enumerate(gaze)]
    head = "Recording timestamp [ms]\tParticipant name\tGaze point X [DACS px]\tGaze point Y [DACS px]"
    return "\n".join([head, *rows]) + "\n"


def glasses(gaze: Pixels) -> str:
    data = [{"gaze2d": [p[0] / WIDTH, p[1] / HEIGHT]} if p else {} for p in gaze]
    rows = [{"type": "gaze", "timestamp": i * STEP_MS / 1000, "data": d} for i, d in enumerate(data)]
    return "".join(json.dumps(row) + "\n" for row in rows)


def eyelink(gaze: Pixels) -> str:
    points = [f"{p[0]}.0\t{p[1]}.0" if p else " .\t ." for p in gaze]
    rows = [f"{5000 + i * STEP_MS}\t{point}\t900.0\t..." for i, point in enumerate(points)]
    head = [f"MSG\t4000 DISPLAY_COORDS 0 0 {WIDTH - 1} {HEIGHT - 1}", "SAMPLES\tGAZE\tLEFT\tRATE\t100.00"]
    return "\n".join([*head, *rows[:200], "MSG\t6995 half time", *rows[200:]]) + "\n"


def smi(gaze: Pixels) -> str:
    rows = [f"{i * STEP_MS * 1000}\tSMP\t1\t{x}\t{y}" for i, (x, y) in enumerate(p or (0, 0) for p in gaze)]
    head = [f"## Calibration Area:\t{WIDTH}\t{HEIGHT}", "Time\tType\tTrial\tL POR X [px]\tL POR Y [px]"]
    return "\n".join([*head, *rows]) + "\n"


def neon(gaze: Pixels) -> str:
    rows = [f"{i * STEP_MS * 10**6},{p[0]},{p[1]}" if p else f"{i * STEP_MS * 10**6},," for i, p in enumerate(gaze)]
    return "\n".join(["timestamp [ns],gaze x [px],gaze y [px]", *rows]) + "\n"


def own(gaze: Pixels) -> str:
    rows = [f"{i * STEP_MS};{x};{y}" for i, (x, y) in enumerate(p or (-1, -1) for p in gaze)]
    return "\n".join(["t;x;y", *rows]) + "\n"


SIZE = ("--screen", f"{WIDTH}x{HEIGHT}")
FILES: dict[str, tuple[Callable[[Pixels], str], tuple[str, ...]]] = {
    "tobii": (tobii, SIZE),
    "glasses": (glasses, ()),
    "eyelink": (eyelink, ()),
    "smi": (smi, ()),
    "neon": (neon, SIZE),
    "own": (own, (*SIZE, "--columns", "t=t:ms,x=x:px,y=y:px", "--lost", "-1")),
}


def play(mesh: LiveMesh, file: Path, session: str, *flags: str) -> None:
    line = [sys.executable, "-m", "shift_cli.main", "gaze", "play", str(file), "--session", session, "--url", mesh.url]
    done = subprocess.run([*line, "--speed", "20", *flags], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr


def sent_without_a_reader(shift: RestClient, session: str) -> dict[str, Any]:
    """Send the gaze as chunks that this test makes; return the partner model's gaze."""
    shift.start("P00", session=session, study=STUDY)
    for seq, begin in enumerate(range(0, len(GAZE), 20)):
        part = GAZE[begin : begin + 20]
        shift.gaze(
            session,
            GazeChunk(
                source="eyes", seq=seq, t=[(begin + i) * STEP_MS / 1000 for i in range(len(part))],
                x=[p and p[0] / WIDTH for p in part], y=[p and p[1] / HEIGHT for p in part],
            ),
        )  # fmt: skip
    found: dict[str, Any] = shift.observation(session)["gaze"]
    return found


def test_every_maker_s_file_leaves_the_weights_of_the_same_gaze(mesh: LiveMesh, tmp_path: Path) -> None:
    with RestClient(mesh.url) as shift:
        expected = sent_without_a_reader(shift, "formats-none")
        assert expected["fixations"] > 3
        for name, (write, flags) in FILES.items():
            file = tmp_path / f"{name}.txt"
            file.write_text(write(GAZE), encoding="utf-8")
            session = f"formats-{name}"
            shift.start("P00", session=session, study=STUDY)
            play(mesh, file, session, *flags)
            found = shift.observation(session)["gaze"]
            assert found["weights"] == pytest.approx(expected["weights"], abs=1e-6), name
            assert (found["fixations"], found["category"]) == (expected["fixations"], expected["category"]), name
            shift.end(session)
    recording = read_recording(mesh.data / "recordings" / "formats-eyelink.mcap")
    assert [marker["text"] for marker in recording["marker"]] == ["DISPLAY_COORDS 0 0 1919 1079", "half time"]
    assert {size for chunk in recording["gaze"] for size in chunk["pupil_left"]} == {900.0}


def test_aoi_names_of_a_file_leave_weights_without_fixations(mesh: LiveMesh, tmp_path: Path) -> None:
    rows = [f"{i * STEP_MS}\t{int(i >= 100)}\t{int(i < 100)}" for i in range(300)]
    head = "Recording timestamp [ms]\tAOI hit [Scene - left]\tAOI hit [Scene - Robot arm]"
    file = tmp_path / "hits.tsv"
    file.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    with RestClient(mesh.url) as shift:
        shift.start("P00", session="formats-aoi", study=STUDY)
        play(mesh, file, "formats-aoi", "--aoi-map", "Robot arm=right")
        found = shift.observation("formats-aoi")["gaze"]
    assert found["fixations"] == 0
    assert found["dwell_s"] == pytest.approx(2.99, abs=0.02)
    assert found["aoi"] == "left"
    assert found["weights"]["left"] > 0
