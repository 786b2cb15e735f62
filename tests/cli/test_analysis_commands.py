"""``whatif``, ``robust`` and ``study plan`` on the command line: what they print and write, and their exit codes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from shift_cli.main import app
from shift_schemas.errors import InvalidSettings, MalformedMessage, UnknownThing
from support.verify_sessions import Session
from typer.testing import CliRunner


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording that has overrides, and a damaged file."""
    folder = tmp_path_factory.mktemp("recordings")
    Session(seed=3).interactions(30).ended().finished(folder)
    (folder / "damaged.mcap").write_bytes(b"no recording")
    return folder


def test_whatif_prints_one_document_and_reports_a_damaged_file(recordings: Path) -> None:
    done = CliRunner().invoke(app, ["whatif", str(recordings), "--learner", "thompson", "--json"])
    found = json.loads(done.stdout)
    assert done.exit_code == 1
    assert "damaged.mcap was left out" in done.stderr
    assert (found["recordings"], found["decisions"]) == (1, 30)
    assert 0 < found["differ"] <= 30
    assert [each["estimator"] for each in found["value"]] == ["ips", "snips", "dr"]
    assert set(found["value"][0]) == {"estimator", "estimate", "low", "high", "ess", "max_weight"}
    for counts in (found["states"], found["strategies"]):
        assert [sum(pair[i] for pair in counts.values()) for i in (0, 1)] == [30, 30]
    assert 0 <= found["support"] <= 1
    assert any("participants: 1" in warning for warning in found["warnings"])


def test_whatif_writes_the_figure_the_decisions_and_the_wizard_s_policy(recordings: Path, tmp_path: Path) -> None:
    line = ["whatif", str(recordings / "s1.mcap"), "--learner", "ucb1", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, line)
    assert done.exit_code == 0
    assert "30 decisions" in done.stdout
    assert "doubly robust" in done.stdout
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {"whatif.json", "whatif.png", "whatif.svg", "decisions.csv", "wizard.json"}
    rows = list(csv.DictReader((tmp_path / "out" / "decisions.csv").open()))
    assert len(rows) == 30
    overridden = [row for row in rows if row["policy_source"] == "override"]
    assert all(row["propensity"] == "" == row["weight"] for row in overridden)
    wizard = json.loads((tmp_path / "out" / "wizard.json").read_text())
    assert sum(wizard["overrides"].values()) == len(overridden)
    assert all(sum(shares.values()) == pytest.approx(1) for shares in wizard["states"].values())
    assert "ucb1" in (tmp_path / "out" / "whatif.svg").read_text()


def test_study_starts_from_the_wizard_s_policy(recordings: Path, tmp_path: Path) -> None:
    CliRunner().invoke(app, ["whatif", str(recordings), "--learner", "ucb1", "--out", str(tmp_path)])
    study = tmp_path / "mine.yaml"
    study.write_text("study: mine\nlearner: {name: q-learning, prior: wizard.json}\n")
    done = CliRunner().invoke(app, ["whatif", str(recordings / "s1.mcap"), "--study", str(study), "--json"])
    assert done.exit_code == 0
    assert json.loads(done.stdout)["decisions"] == 30


def test_whatif_needs_a_policy_that_exists(recordings: Path, tmp_path: Path) -> None:
    one = str(recordings / "s1.mcap")
    with pytest.raises(InvalidSettings, match="give --study FILE, --learner NAME, or both"):
        CliRunner().invoke(app, ["whatif", one], catch_exceptions=False)
    with pytest.raises(MalformedMessage, match="did you mean 'ucb1'"):
        CliRunner().invoke(app, ["whatif", one, "--learner", "ucb"], catch_exceptions=False)
    with pytest.raises(UnknownThing, match="there is no study file"):
        CliRunner().invoke(app, ["whatif", one, "--study", str(tmp_path / "no.yaml")], catch_exceptions=False)


def test_robust_prints_shares_for_all_and_for_each_participant(recordings: Path) -> None:
    done = CliRunner().invoke(app, ["robust", str(recordings), "--json"])
    found = json.loads(done.stdout)
    assert done.exit_code == 1
    assert list(found["problems"]) == ["damaged.mcap"]
    assert len(found["all"]) == 27
    assert found["participants"]["P01"]["noise 0.5 deg"]["decisions"] == 30
    table = CliRunner().invoke(app, ["robust", str(recordings / "s1.mcap"), "--by-participant"])
    assert table.exit_code == 0
    assert "participant P01" in table.stdout
    assert "moved 0.5 deg" in table.stdout


def test_study_plan_answers_for_a_learner_and_for_two_conditions(tmp_path: Path) -> None:
    line = ["study", "plan", "coffee", "--learner", "thompson", "--sessions", "10", "--data", str(tmp_path), "--json"]
    found = json.loads(CliRunner().invoke(app, line).stdout)
    assert found["simulated"] == 10
    assert set(found["comparison"]) == {"difference", "sd", "effect", "sessions", "power"}
    study = tmp_path / "mine.yaml"
    study.write_text(
        "study: mine\ninteractions: 10\nconditions: {a: {learner: {name: scoring}}, b: {learner: {name: planner}}}\n"
    )
    done = CliRunner().invoke(
        app, ["study", "plan", str(study), "--condition", "a", "--condition", "b", "--sessions", "10", "--user", "B"]
    )
    assert done.exit_code == 0
    assert "power with 20 sessions" in done.stdout


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "give either --learner"),
        (["--condition", "control"], "two conditions are compared"),
        (["--condition", "control", "--condition", "nowhere"], "no condition 'nowhere'"),
    ],
)
def test_study_plan_says_what_is_missing(more: list[str], said: str) -> None:
    done = CliRunner().invoke(app, ["study", "plan", "coffee", *more])
    assert said in str(done.exception)
