"""The commands of ``evaluate``: their JSON documents, exit codes, files and tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_simulator.commands import app
from shift_simulator.table2 import table2
from shift_simulator.user_study import users
from shift_simulator.users import paper_user
from typer.testing import CliRunner

RUNNER = CliRunner()


def invoke_json(*arguments: str) -> tuple[int, dict[str, object]]:
    result = RUNNER.invoke(app, [*arguments, "--json"], catch_exceptions=False)
    return result.exit_code, json.loads(result.stdout)


def test_table2_prints_one_document_and_exits_with_0_if_the_criterion_holds() -> None:
    code, document = invoke_json("table2", "--seed", "0")
    assert code == 0
    assert document == table2(0, 500)
    assert (document["seed"], document["runs"]) == (0, 500)
    assert set(document["rows"][0]) == {
        *("row", "prior", "learning_rate", "discount", "z_mean", "z_sd", "r_mean", "r_sd", "paper")
    }


def test_exit_code_is_1_if_the_criterion_does_not_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shift_simulator.table2.EPISODES", 20)
    code, document = invoke_json("table2", "--runs", "20")
    assert code == 1
    assert not all(point["passed"] for point in document["criterion"])


def test_options_are_read_from_environment_variables() -> None:
    result = RUNNER.invoke(app, ["users", "--json"], env={"SHIFT_RUNS": "10", "SHIFT_SEED": "5"})
    document = json.loads(result.stdout)
    assert (document["runs"], document["seed"]) == (10, 5)


def test_users_writes_json_png_and_svg(tmp_path: Path) -> None:
    RUNNER.invoke(app, ["users", "--runs", "20", "--out", str(tmp_path)])
    assert {p.name for p in tmp_path.iterdir()} == {"users.json", "users.png", "users.svg"}
    assert (tmp_path / "users.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "users.json").read_text()) == users(0, 20)


def test_learners_accepts_user_files_and_reports_the_documented_fields(tmp_path: Path) -> None:
    file = tmp_path / "me.json"
    file.write_text(paper_user("B").model_copy(update={"user": "me"}).model_dump_json(exclude={"capacity"}))
    code, document = invoke_json(
        "learners", "--learner", "scoring", "--learner", "planner", "--user", str(file), "--runs", "10", "--regret"
    )
    assert code == 0
    first = document["results"][0]
    assert (first["learner"], first["user"]) == ("scoring", "me")
    names = {"learner", "user", "reward_mean", "reward_se", "break_even", "regret_mean", "worst_dip"}
    assert names <= set(first)
    assert first["regret_mean"] == pytest.approx(50.0 - first["reward_mean"], abs=0.05)
    without = invoke_json("learners", "--learner", "scoring", "--user", "A", "--runs", "5")[1]
    assert without["results"][0]["regret_mean"] is None


def test_tables_are_printed_without_json() -> None:
    for arguments in (["table2"], ["users"], ["learners", "--learner", "scoring"]):
        result = RUNNER.invoke(app, [*arguments, "--runs", "10"])
        assert result.exit_code in (0, 1)
        assert "±" in result.stdout
