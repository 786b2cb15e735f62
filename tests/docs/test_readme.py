"""The README's command lines and programs work as printed, with a mesh of their own."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

from support.whole_mesh import LiveMesh, running_mesh

ROOT = Path(__file__).resolve().parents[2]
TOUR = re.compile(r"<!-- tour -->\n```sh\n(.*?)```", re.DOTALL)
BLOCK = re.compile(r"(?:<!-- (.*?) -->\n)?```(\w+)\n(.*?)```", re.DOTALL)


def blocks(mark: str, language: str) -> list[str]:
    """Return the README's blocks of a language that follow a comment with this text."""
    found = BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    return [text for marked, kind, text in found if (marked, kind) == (mark, language)]


def in_a_fresh_clone(folder: Path, mesh: LiveMesh) -> dict[str, str]:
    """Make ``folder`` look like a fresh clone. Return the environment that leads programs to this test's mesh."""
    for name in ("docs", "tests"):
        (folder / name).symlink_to(ROOT / name)
    return {
        **os.environ, "SHIFT_URL": mesh.url, "SHIFT_ZENOH": mesh.zenoh, "SHIFT_ROS_ROUTER": mesh.zenoh,
        "COLUMNS": "120", "SHIFT_PAUSE": "0",
    }  # fmt: skip


def as_here(text: str, mesh: LiveMesh) -> str:
    """Return the text with this test's mesh and Python in place of those that the README assumes."""
    text = text.replace("http://127.0.0.1:8080", mesh.url)
    return text.replace(".venv/bin/shift-mesh", f"{sys.executable} -m shift_cli.main")


def test_every_line_outside_the_tour_works_as_printed(tmp_path: Path) -> None:
    make, *lines = blocks("", "sh")
    programs, (study,), ros = blocks("", "python"), blocks("", "yaml"), blocks("until Ctrl-C", "sh")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for line in make.splitlines():
        assert re.search(rf"^{line.split()[1]}:", makefile, re.MULTILINE), line
    with running_mesh(tmp_path) as mesh:
        env = in_a_fresh_clone(tmp_path, mesh)
        (mesh.data / "studies" / "coffee.yaml").write_text(study, encoding="utf-8")
        run = partial(subprocess.run, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=240, check=False)
        for line in (line for block in lines for line in block.splitlines()):
            done = run(["bash", "-euc", as_here(line, mesh)])
            assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        for program in programs * 2:
            done = run([sys.executable, "-c", as_here(program, mesh)])
            assert done.returncode == 0, done.stderr
            assert "because" in done.stdout
        for line in ros:
            until_ctrl_c(as_here(line, mesh), env, tmp_path)
    assert len(lines) >= 2
    assert len(programs) == len(ros) == 1


def until_ctrl_c(line: str, env: dict[str, str], folder: Path) -> None:
    """Run a line until it says that its session began, stop it as Ctrl-C does, and check that it ends well."""
    process = subprocess.Popen(["bash", "-euc", f"exec {line}"], cwd=folder, env=env, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert any(" session begun " in line for line in process.stderr), "it ended before its session began"
    process.send_signal(signal.SIGINT)
    said = process.stderr.read()
    assert process.wait(60) == 0, said
    assert "Traceback" not in said


def test_example_of_a_user_file_has_every_field_that_is_often_changed() -> None:
    example = json.loads((ROOT / "docs" / "examples" / "my-user.json").read_text(encoding="utf-8"))
    assert set(example) == {"user", "success", "gaze", "tasks", "capacity"}


def test_the_tour_works_as_printed(tmp_path: Path) -> None:
    steps = TOUR.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(steps) == 7
    with running_mesh(tmp_path) as mesh:
        printed = []
        for step in steps:
            text = step.replace("http://127.0.0.1:8080", mesh.url)
            text = text.replace(".venv/bin/shift-mesh", f"{sys.executable} -m shift_cli.main")
            text = text.replace(" replay ", f" replay --zenoh {mesh.zenoh} ")
            done = subprocess.run(["bash", "-euc", text], cwd=tmp_path, capture_output=True, text=True, timeout=60)
            assert done.returncode == 0, done.stderr
            printed.append(done.stdout)
    started, gaze, decision, performance, _, ended, _ = printed
    assert json.loads(started)["state"] == "live"
    assert json.loads(gaze) == {"accepted": 3}
    assert json.loads(decision)["n"] == 1
    assert json.loads(performance)["reward"] > 0
    assert json.loads(ended)["counts"]["decision"] == 1


def test_tables_of_the_study_page_are_current() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    import make_study_reference

    page = make_study_reference.PAGE.read_text(encoding="utf-8")
    assert make_study_reference.with_tables(page) == page, "run: python docs/make_study_reference.py"
