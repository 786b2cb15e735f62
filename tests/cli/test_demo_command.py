"""``shift-mesh demo --robot``: a dialogue with a mesh of its own, or with the one that runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from shift_runtime.study_files import find_study
from shift_study.phrases import text_for
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(120)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    """A mesh that runs already."""
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


def demo(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the demonstration in a folder, with its temporary files there too."""
    line = [sys.executable, "-m", "shift_cli.main", "demo", *words]
    env = {k: v for k, v in os.environ.items() if not k.startswith("SHIFT_")} | {"TMPDIR": str(folder)}
    return subprocess.run(line, capture_output=True, text=True, timeout=100, cwd=folder, env=env, check=False)


def sentences(study: str, folder: Path) -> set[str]:
    """Return every text of a built-in study."""
    found = find_study(study, folder)
    assert found is not None
    assert found.study is not None
    tasks, choices = found.study.tasks or [], found.study.scoring.choices
    return {str(text_for(found.study.phrases, task, choice)) for task in tasks for choice in choices}


@pytest.mark.parametrize("study", ["coffee", "coffee_de"])
def test_dialogue_runs_on_the_mesh_that_runs_and_says_the_sentences_of_the_study(
    study: str, mesh: LiveMesh, tmp_path: Path
) -> None:
    done = demo(tmp_path, "--robot", "--study", study, "--pause", "0", "--episodes", "6", "--url", mesh.url)
    assert done.returncode == 0, done.stderr
    assert f"A mesh runs at {mesh.url}; the dialogue uses it." in done.stdout
    said = re.findall("“(.*)”", done.stdout)
    assert len(said) == 6
    assert set(said) <= sentences(study, tmp_path)
    assert len(re.findall(r"^  Person  (?:does it after \d s|does not manage it)$", done.stdout, re.MULTILINE)) == 6
    assert re.search(r"Verified: \d+ messages were computed again from demo-robot-\w+\.mcap, with no diff", done.stdout)


def test_the_same_seed_is_the_same_dialogue(mesh: LiveMesh, tmp_path: Path) -> None:
    words = ("--robot", "--pause", "0", "--episodes", "4", "--url", mesh.url)
    first, again = (demo(tmp_path, *words).stdout.partition("Verified")[0] for _ in range(2))
    assert first == again
    assert demo(tmp_path, *words, "--seed", "8").stdout.partition("Verified")[0] != first


def test_dialogue_starts_a_mesh_of_its_own_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from shift_cli.demo_command import _own_mesh
    from shift_runtime.rest_client import RestClient

    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    with _own_mesh() as url, RestClient(url) as shift:
        assert shift.ready()["ready"]
        assert list(tmp_path.iterdir())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "says"),
    [((), "shift-mesh demo --robot is a dialogue"), (("--robot", "--study", "cofee"), "did you mean 'coffee'?"),
     (("--robot", "--url", "http://127.0.0.1:1"), "no gateway answers at http://127.0.0.1:1")],
)  # fmt: skip
def test_wrong_use_is_one_sentence(words: tuple[str, ...], says: str, tmp_path: Path) -> None:
    done = demo(tmp_path, *words)
    assert done.returncode == 2
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def test_study_with_other_actions_than_the_person_s_is_refused(tmp_path: Path, mesh: LiveMesh) -> None:
    (tmp_path / "data" / "studies").mkdir(parents=True)
    study = "study: two\nscoring: {strategies: {hesitation: null}}\ncapacity: {demanding: [negation]}\n"
    (tmp_path / "data" / "studies" / "two.yaml").write_text(study)
    done = demo(tmp_path, "--robot", "--study", "two", "--url", mesh.url)
    assert done.returncode == 2
    assert "study two has 3 actions, and the simulated person knows 6" in done.stderr
