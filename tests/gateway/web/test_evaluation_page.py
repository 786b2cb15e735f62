"""The evaluation in the browser: run with progress, cancelled, and compared with the command line's numbers."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from shift_gateway.web.evaluation_view import criterion_lines, figure_options, table_rows
from support.browser import WAIT_MS, Tab


def evaluated(experiment: str, runs: int) -> dict:
    """Return the command line's result."""
    command = [sys.executable, "-m", "shift_cli.main", "evaluate", experiment, "--json", "--runs", str(runs)]
    done = subprocess.run([*command, "--seed", "3"], capture_output=True, text=True, check=False)
    assert " of " in done.stderr, "progress goes to standard error"
    result: dict = json.loads(done.stdout)
    return result


@pytest.mark.parametrize(("experiment", "rows"), [("table2", 12), ("users", 8)])
def test_experiment_is_run_and_shows_the_command_line_s_numbers(tab: Tab, experiment: str, rows: int) -> None:
    wanted = table_rows(experiment, result := evaluated(experiment, 10))  # type: ignore[arg-type]
    assert len(wanted) == rows
    assert figure_options(experiment, result)["series"]  # type: ignore[arg-type]
    tab.go("/evaluation")
    if experiment == "users":
        tab.choose("evaluation-experiment", "Users A to D, with and without the scoring prior")
    tab.fill("evaluation-runs", "10")
    tab.fill("evaluation-seed", "3")
    tab.click("evaluation-run")
    tab.wait_text("evaluation-state", "Done: seed 3, 10 sessions in each row.")
    shown = tab.text("evaluation-table")
    for row in wanted:
        for value in row.values():
            assert value in shown
    for _, line in criterion_lines(result):
        assert line in tab.text("evaluation-result")


def test_evaluation_is_cancelled_and_only_one_runs_at_a_time(open_tab) -> None:
    with open_tab() as one, open_tab() as other:
        for tab in (one, other):
            tab.go("/evaluation")
            tab.fill("evaluation-runs", "20000")
        one.click("evaluation-run")
        one.wait_text("evaluation-state", "Running ")
        other.click("evaluation-run")
        other.wait_text("evaluation-state", "another evaluation runs on this gateway")
        one.click("evaluation-cancel")
        one.wait_text("evaluation-state", "The evaluation was cancelled.")
        other.fill("evaluation-runs", "10")
        other.click("evaluation-run")
        other.wait_text("evaluation-state", "Done: ")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_evaluation_has_no_serious_finding_of_axe(open_tab, dark: bool) -> None:
    with open_tab(dark=dark) as tab:
        tab.go("/evaluation")
        tab.fill("evaluation-runs", "10")
        tab.click("evaluation-run")
        tab.wait_text("evaluation-state", "Done: ")
        tab.page.locator(".q-table__middle[tabindex]").first.wait_for(timeout=WAIT_MS)
        assert tab.serious_findings() == []
