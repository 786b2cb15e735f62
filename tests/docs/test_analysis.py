"""The programs of docs/analysis.md run, on a recording that an in-process mesh has just made."""

from __future__ import annotations

import asyncio
import csv
import json
import re
import subprocess
import sys
from pathlib import Path

from support.gateway_mesh import running_mesh

PAGE = Path(__file__).resolve().parents[2] / "docs" / "analysis.md"
PROGRAMS = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


async def record_tour(data: Path) -> None:
    """Record a session with gaze points, AOI names, two decisions, one report and its correction."""
    async with running_mesh(data) as mesh:
        await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "session": "tour", "study": "coffee", "seed": 7})
        path = "/v1/sessions/tour"
        points = {"source": "tx300", "seq": 0, "t": [0.0, 0.01, 0.02], "x": [0.5, None, 0.5], "y": [0.5, None, 0.5]}
        await mesh.ask("POST", f"{path}/gaze", points)
        await mesh.ask("POST", f"{path}/gaze", {"source": "names", "seq": 0, "t": [0.0, 0.5], "aoi": ["cup", None]})
        for number, success in (("d1", True), ("d2", False)):
            await mesh.ask("POST", f"{path}/decisions", {"task": "grasp", "decision_id": number})
            result = {"success": success, "duration_s": 5.0}
            report = {"decision_id": number, "comprehension": result, "enabledness": result}
            answer = await mesh.ask("POST", f"{path}/performance", report)
            assert answer.status_code == 201, answer.text
        right = {"success": True, "duration_s": 4.0}
        correction = {"decision_id": "d2", "comprehension": right, "enabledness": right, "corrects": True}
        answer = await mesh.ask("POST", f"{path}/performance", correction)
        assert answer.status_code == 201, answer.text
        await mesh.ask("POST", f"{path}/decisions", {"task": "turn", "decision_id": "d3"})
        answer = await mesh.ask("POST", f"{path}/end")
        assert answer.json()["recording"] == "tour.mcap"


def run(program: str, folder: Path) -> str:
    """Run one program of the page in ``folder``; return what it prints."""
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{program}\n{done.stderr}"
    return done.stdout


def test_every_python_program_of_the_analysis_page_runs(tmp_path: Path) -> None:
    asyncio.run(record_tour(tmp_path / "data"))
    programs = PROGRAMS.findall(PAGE.read_text(encoding="utf-8"))
    assert len(programs) == 5
    decisions, gaze, pandas, plain, lines = (run(program, tmp_path) for program in programs)
    assert decisions == "3 decisions; the file was read completely\n"
    assert gaze == "5 samples\n"
    assert "P01" in pandas
    assert len(plain.splitlines()) == 3
    assert lines == ""
    rows = list(csv.DictReader((tmp_path / "decisions.csv").open(encoding="utf-8")))
    assert [row["comprehension"] for row in rows] == ["True", "True", ""], "the correction wins; d3 has no report"
    samples = list(csv.DictReader((tmp_path / "gaze.csv").open(encoding="utf-8")))
    assert [s["valid"] for s in samples] == ["True", "False", "True", "", ""]
    topics = {json.loads(line)["topic"] for line in (tmp_path / "tour.jsonl").read_text(encoding="utf-8").splitlines()}
    assert {"session", "gaze", "decision", "performance"} <= topics
