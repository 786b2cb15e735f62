"""``shift-mesh study``: studies checked, shown and listed without a mesh."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from shift_cli.main import app
from shift_study.loading import parse_study, study_data
from typer.testing import CliRunner, Result

RUNNER = CliRunner()


def run(*words: object, exit_code: int = 0) -> Result:
    """Run ``shift-mesh study`` with these words."""
    done = RUNNER.invoke(app, ["study", *map(str, words)])
    assert done.exit_code == exit_code, (done.output, done.exception)
    return done


def document(*words: object, exit_code: int = 0) -> Any:
    """Return the one JSON document on standard output."""
    return json.loads(run(*words, "--json", exit_code=exit_code).stdout)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Return a data folder with a valid study, a study with warnings, and one with two mistakes."""
    folder = tmp_path / "studies"
    folder.mkdir()
    (folder / "own.yaml").write_text("study: own\ntitle: My own\ntasks: [on, off]\n")
    (folder / "far.yaml").write_text("study: far\nfixation: {distance_cm: 650}\n")
    (folder / "bad.yaml").write_text("study: bad\nlearner: {epsilon: 75%}\ntasks: [grasp cup]\n")
    return tmp_path


def test_a_study_without_mistakes_is_checked_with_exit_code_0(data: Path) -> None:
    said = run("check", data / "studies" / "own.yaml").stdout
    assert "own.yaml: no mistakes, 0 warnings; study own: tasks on, off; AOIs left, middle, right" in said


def test_a_doubtful_study_is_checked_with_exit_code_0_and_its_warnings(data: Path) -> None:
    said = run("check", data / "studies" / "far.yaml").stdout
    assert said.startswith("warning: fixation.distance_cm is 650: ")
    assert "no mistakes, 1 warning;" in said


def test_mistakes_are_said_line_by_line_with_exit_code_1(data: Path) -> None:
    first, second, verdict = run("check", data / "studies" / "bad.yaml", exit_code=1).stdout.splitlines()
    assert first.startswith("bad.yaml:2: learner.epsilon: '75%' is not valid: write the share of one")
    assert second.startswith("bad.yaml:3: tasks.0: 'grasp cup' is not an id")
    assert verdict.endswith("bad.yaml: 2 mistakes; no session can be started with it")


def test_a_check_as_json_is_one_document(data: Path) -> None:
    fine = document("check", data / "studies" / "far.yaml")
    assert (fine["study"], fine["mistakes"], len(fine["warnings"])) == ("far", [], 1)
    bad = document("check", data / "studies" / "bad.yaml", exit_code=1)
    assert (bad["study"], len(bad["mistakes"]), bad["warnings"]) == (None, 2, [])


def test_a_file_that_is_not_there_is_wrong_use(data: Path) -> None:
    run("check", data / "nowhere.yaml", exit_code=2)
    run("check", data, exit_code=2)


def test_a_shown_study_has_every_default_and_is_a_study_file_again(data: Path) -> None:
    shown = run("show", "own", "--data", data).stdout
    own = parse_study((data / "studies" / "own.yaml").read_text())
    assert parse_study(shown) == own
    for key in ("learning_rate: 0.25", "distance_cm: 65.0", "tasks: [on, off]", "wait_s: 2.0"):
        assert key in shown
    assert document("show", "own", "--data", data) == study_data(own)


def test_the_data_folder_may_be_named_by_the_environment(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHIFT_DATA", str(data))
    assert document("show", "own")["title"] == "My own"


def test_warnings_of_a_shown_study_go_to_standard_error(data: Path) -> None:
    done = run("show", "far", "--data", data)
    assert "warning: fixation.distance_cm is 650" in done.stderr
    assert "warning" not in done.stdout


def test_a_study_with_mistakes_is_not_shown(data: Path) -> None:
    done = run("show", "bad", "--data", data, exit_code=1)
    assert done.stdout == ""
    assert "bad.yaml:2: learner.epsilon" in done.stderr


def test_an_unknown_study_is_wrong_use_and_the_nearest_is_named(data: Path) -> None:
    done = RUNNER.invoke(app, ["study", "show", "cofee", "--data", str(data)])
    assert "there are bad, coffee, coffee_de, default, far, own; did you mean 'coffee'?" in str(done.exception)


def test_every_study_is_listed_with_where_it_is_from(data: Path) -> None:
    said = run("list", "--data", data, exit_code=1).stdout
    rows = {line.split()[0]: line.split() for line in said.splitlines() if line.startswith(" ")}
    assert rows["own"][-2:] == ["0", "0"]
    assert rows["far"][-2:] == ["0", "1"]
    assert rows["bad"][-2:] == ["2", "0"]
    assert "built-in" in rows["coffee"]
    assert "bad: bad.yaml:2: learner.epsilon" in said
    assert "far: fixation.distance_cm is 650" in said


def test_a_list_as_json_has_names_titles_mistakes_and_warnings(data: Path) -> None:
    found = {s["name"]: s for s in document("list", "--data", data, exit_code=1)["studies"]}
    assert list(found) == ["bad", "coffee", "coffee_de", "default", "far", "own"]
    assert (found["own"]["title"], found["own"]["mistakes"], found["own"]["warnings"]) == ("My own", [], [])
    assert (len(found["bad"]["mistakes"]), len(found["far"]["warnings"])) == (2, 1)
    assert found["coffee"]["place"] == "built-in"


def test_without_a_folder_the_built_in_studies_are_listed_and_that_is_said(tmp_path: Path) -> None:
    done = run("list", "--data", tmp_path)
    assert f"{tmp_path / 'studies'} is not there; the built-in studies only" in done.stderr
    assert [s["name"] for s in document("list", "--data", tmp_path)["studies"]] == ["coffee", "coffee_de", "default"]


@pytest.mark.parametrize("command", ["check", "show", "list"])
def test_the_help_has_examples(command: str) -> None:
    assert f"shift-mesh study {command}" in run(command, "--help").stdout
