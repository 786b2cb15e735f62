"""The README's tour works as printed, against a mesh of its own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

from mesh import running_mesh

ROOT = Path(__file__).resolve().parents[2]
TOUR = re.compile(r"<!-- tour -->\n```sh\n(.*?)```", re.DOTALL)


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


def test_the_studys_tables_are_current() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    import make_study_reference

    page = make_study_reference.PAGE.read_text(encoding="utf-8")
    assert make_study_reference.with_tables(page) == page, "run: python docs/make_study_reference.py"


def test_every_page_that_the_readme_links_to_is_there() -> None:
    links = re.findall(r"\]\((?!https?:|#)([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
