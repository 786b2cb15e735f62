"""The exercises of docs/contributing.md work: each change applies to a copy of the source, and its program runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "contributing.md"
EXERCISE = re.compile(r"^### (\d)\. .*?(?=^### |\Z)", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def block(number: int, language: str) -> str:
    """Return the one block of a language in an exercise."""
    exercises = {match[1]: match[0] for match in EXERCISE.finditer(PAGE.read_text(encoding="utf-8"))}
    found = [text for kind, text in BLOCK.findall(exercises[str(number)]) if kind == language]
    assert len(found) == 1, f"exercise {number} has {len(found)} blocks of {language}"
    return found[0]


def copied_tree(folder: Path) -> Path:
    """Copy the source tree into ``folder``, without what Python made of it."""
    without = shutil.ignore_patterns("__pycache__")
    for room in ("schemas", "services", "tests/support"):
        shutil.copytree(ROOT / room, folder / room, ignore=without)
    return folder


def apply(number: int, tree: Path) -> None:
    """Apply the change of an exercise to a copy of the source tree."""
    command = ["git", "apply", "--whitespace=error", "-"]
    environment = {**os.environ, "GIT_CEILING_DIRECTORIES": str(tree.parent)}
    done = subprocess.run(
        command, cwd=tree, env=environment, input=block(number, "diff"), capture_output=True, text=True
    )
    assert done.returncode == 0, f"exercise {number} does not apply any more; make its diff again:\n{done.stderr}"


def run(number: int, tree: Path) -> str:
    """Run the program of an exercise with the packages of the copy alone; return what it prints."""
    packages = [str(path.parent.parent) for path in tree.glob("s*/**/shift_*/__init__.py")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*packages, str(tree / "tests")])}
    command = [sys.executable, "-c", block(number, "python")]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_strategy_of_the_first_exercise_needs_a_study_file_alone(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    (tree / "gestures.yaml").write_text(block(1, "yaml"), encoding="utf-8")
    assert "12 actions" in run(1, tree)


def test_learner_of_the_second_exercise_decides_in_a_simulated_session(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    apply(2, tree)
    assert run(2, tree) == "20 interactions, policies from {'learner'}\n"


def test_gaze_input_of_the_third_exercise_reads_a_file(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    apply(3, tree)
    assert run(3, tree) == "2 samples, the second one is lost\n"


def test_subject_of_the_fourth_exercise_has_a_key_and_a_topic(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    apply(4, tree)
    assert run(4, tree) == "shift/v1/s1/rating of the recorder True\n"


def test_command_of_the_fifth_exercise_is_answered_over_http_and_its_recording_verifies(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path)
    apply(4, tree)
    apply(5, tree)
    said = run(5, tree)
    assert "201 effort 3\n422 effort\n" in said
    assert "1 rating recorded, verified: True\n" in said
