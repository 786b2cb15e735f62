"""The panel of a recording that decides it again under another study or learner."""

from __future__ import annotations

import asyncio
from contextlib import aclosing
from pathlib import Path
from typing import get_args

from nicegui import ui
from shift_model.vocabulary import LearnerName
from shift_runtime.study_files import list_studies
from shift_study.loading import study_json

from shift_gateway.web.data_table import DataTable
from shift_gateway.web.layout import explain, testid, text
from shift_gateway.web.panels import panel
from shift_gateway.web.recording_whatif import WORK, WhatIfResult
from shift_gateway.web.worker_process import WorkFailed, parts_of

RECORDED = "as recorded"
EXPLANATION = (
    "Each decision is made again in the situation that was recorded. The value is estimated from the recorded "
    "probabilities. This is what shift-mesh whatif does (docs: what-if)."
)


class WhatIfPanel:
    """The elements of the panel."""

    def __init__(self, path: Path, studies: Path) -> None:
        self._path = path
        self._studies = {found.name: found.study for found in list_studies(studies) if found.study is not None}
        self._work: asyncio.Task[None] | None = None
        with panel("What if?"):
            with ui.element("div").classes("bar"):
                self._study = self._select("study", self._studies, "whatif-study")
                self._learner = self._select("learner", get_args(LearnerName), "whatif-learner")
                self._button = testid(ui.button("Decide again", on_click=self._start).props("outline"), "whatif")
                explain(self._button, EXPLANATION)
                self._result = text("", "", "whatif-result").props('role="status"')
            self._values = DataTable(
                "whatif-values", "Value of a decision", ("mean reward", "estimate", "95 % interval", "sample size")
            )
            self._counts = DataTable(
                "whatif-counts", "States and strategies", ("state or strategy", "recorded", "other")
            )
            self._warnings = text("", "warning", "whatif-warnings")
            self._figure = ui.element("div")
        ui.context.client.on_delete(self._stop)

    def _select(self, label: str, names: object, name: str) -> ui.select:
        select = ui.select([RECORDED, *names], value=RECORDED, label=label)  # type: ignore[misc]
        return testid(select.props("dense outlined options-dense").style("min-width: 10rem"), name)

    def _start(self) -> None:
        if self._study.value == RECORDED and self._learner.value == RECORDED:
            ui.notify("Choose another study or another learner.", type="warning")
            return
        self._button.set_enabled(False)
        self._result.text = "Deciding again …"
        self._warnings.text = ""
        self._work = asyncio.create_task(self._decide())

    def _stop(self) -> None:
        if self._work is not None:
            self._work.cancel()

    async def _decide(self) -> None:
        study = self._studies.get(str(self._study.value))
        learner = "" if self._learner.value == RECORDED else str(self._learner.value)
        arguments = (str(self._path), study_json(study) if study is not None else "", learner)
        try:
            async with aclosing(parts_of(WORK, *arguments)) as parts:
                async for part in parts:
                    if isinstance(part, WhatIfResult):
                        self._show(part)
        except WorkFailed as e:
            self._result.text = f"The recording could not be decided again: {e.detail}."
        finally:
            self._button.set_enabled(True)

    def _show(self, result: WhatIfResult) -> None:
        self._result.text = result.sentence
        self._warnings.text = " ".join(f"Note: {warning}." for warning in result.warnings)
        self._figure.clear()
        with self._figure:
            chart = ui.echart(result.chart, renderer="svg").style(f"height: {result.chart['height']}px; width: 100%")
            testid(chart, "whatif-chart")
        with self._result:
            ui.run_javascript(self._values.script(result.values) + self._counts.script(result.counts))
