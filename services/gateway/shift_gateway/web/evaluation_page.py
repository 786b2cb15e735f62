"""The evaluation at ``/evaluation``: the paper's experiments, run here, beside the paper's numbers."""

from __future__ import annotations

import asyncio
from typing import Any

from nicegui import ui
from shift_schemas.errors import ShiftError

from shift_gateway.web.evaluation_run import Evaluations
from shift_gateway.web.evaluation_view import (
    EXPERIMENTS,
    PAPER_RUNS,
    Experiment,
    criterion_lines,
    figure_options,
    table_rows,
)
from shift_gateway.web.layout import Frame, explain, testid, text


def add_evaluation_page() -> None:
    """Add the page."""
    evaluations = Evaluations()

    @ui.page("/evaluation")
    async def evaluation() -> None:
        Frame("Evaluation")
        client = ui.context.client
        await client.connected()
        page = EvaluationPage(evaluations)
        client.on_delete(page.cancel)


class EvaluationPage:
    """The elements of one open evaluation page."""

    def __init__(self, evaluations: Evaluations) -> None:
        self._evaluations = evaluations
        self._task: asyncio.Task[None] | None = None
        with ui.element("div").classes("page"):
            text("Evaluation: the paper’s simulations", tag="h1")
            text(f"Simulated users, no participants. The paper has {PAPER_RUNS} sessions in each row.", "muted")
            with ui.element("div").classes("panel bar"):
                self._experiment = ui.select(dict(EXPERIMENTS), value="table2", label="Experiment")
                testid(self._experiment.props("dense outlined options-dense"), "evaluation-experiment")
                self._runs = self._number("Sessions in each row", PAPER_RUNS, 2, 100_000, "evaluation-runs")
                self._seed = self._number("Seed", 0, 0, 2**53 - 1, "evaluation-seed")
                self._start_button = testid(ui.button("Run", on_click=self._start).props("outline"), "evaluation-run")
                self._cancel_button = testid(
                    ui.button("Cancel", on_click=self.cancel).props("flat"), "evaluation-cancel"
                )
            self._progress = ui.linear_progress(0, show_value=False).props('aria-label="Share that is done"')
            self._state = testid(text("").props('role="status"'), "evaluation-state")
            self._result = testid(ui.element("div").classes("page").style("padding: 0"), "evaluation-result")
        self._show_running(False)

    def _number(self, label: str, value: int, least: int, most: int, name: str) -> ui.number:
        field = ui.number(label, value=value, min=least, max=most, precision=0).props("dense outlined")
        return explain(testid(field, name), "The same seed gives the same numbers.")

    def _show_running(self, running: bool) -> None:
        self._start_button.set_enabled(not running)
        self._cancel_button.set_visibility(running)
        self._progress.set_visibility(running)

    def _start(self) -> None:
        if self._runs.value is None or self._seed.value is None:
            ui.notify("Give the number of sessions and the seed.", type="warning")
            return
        experiment: Experiment = self._experiment.value
        self._task = asyncio.create_task(self._run(experiment, int(self._runs.value), int(self._seed.value)))

    def cancel(self) -> None:
        """End the evaluation of this page, if one runs."""
        if self._task is not None:
            self._task.cancel()

    async def _run(self, experiment: Experiment, runs: int, seed: int) -> None:
        self._result.clear()
        self._progress.value = 0
        self._state.text = f"Running {EXPERIMENTS[experiment]}, {runs} sessions in each row."
        self._show_running(True)
        try:
            result = await self._evaluations.run(experiment, runs, seed, self._on_progress)
        except ShiftError as e:
            self._state.text = e.detail
        except asyncio.CancelledError:
            self._state.text = "The evaluation was cancelled."
        else:
            self._state.text = f"Done: seed {seed}, {runs} sessions in each row."
            with self._result:
                _draw(experiment, result)
        finally:
            self._show_running(False)

    def _on_progress(self, share: float) -> None:
        self._progress.value = share


def _draw(experiment: Experiment, result: dict[str, Any]) -> None:
    """Draw the result: the criterion, the figure and the table."""
    with ui.element("section").classes("panel"):
        text("Criterion, fixed before the first run (docs/evaluation.md)", tag="h2")
        for holds, line in criterion_lines(result):
            text(line, "ok" if holds else "warning")
    with ui.element("section").classes("panel"):
        text(EXPERIMENTS[experiment], tag="h2")
        ui.echart(figure_options(experiment, result)).style("height: 20rem; width: 100%")
        rows = table_rows(experiment, result)
        columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in rows[0]]
        for i, row in enumerate(rows):
            row["key"] = str(i)
        table = ui.table(columns=columns, rows=rows, row_key="key").props("flat dense")
        testid(table.classes("sessions"), "evaluation-table")
