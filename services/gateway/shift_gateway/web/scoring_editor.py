"""The editor of strategy weights and the scoring table, with the triples that an edit would move to another state."""

from __future__ import annotations

from typing import Any

from nicegui import ui
from shift_schemas.errors import ShiftError
from shift_study.study import Study

from shift_gateway.web.data_table import DataTable
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import explain, show_error, testid, text
from shift_gateway.web.panels import panel
from shift_gateway.web.scoring_edits import (
    categories,
    changed_states,
    editable,
    scoring_patch,
    table_name,
    value_at,
)
from shift_gateway.web.steering import Steering
from shift_gateway.web.table_rows import Row


class ScoringEditor:
    """The inputs; each follows the newest configuration until it is edited."""

    def __init__(self, history: SessionHistory, steering: Steering, study: Study) -> None:
        self._history = history
        self._steering = steering
        self._inputs: dict[str, ui.input] = {}
        self._shown: dict[str, str] = {}
        """The configuration's value of each input, as it is written into it."""
        self._version = 0
        self._previewed: tuple[Any, ...] = ()
        with panel("Scoring table", anchor="scoring") as heading:
            explain(heading, "How much each observation speaks for each strategy, and the weights (paper, Table I).")
            self._grid(study)
            with ui.element("div").classes("bar"):
                testid(ui.button("Preview", on_click=self._preview).props("outline"), "preview")
                testid(ui.button("Apply", on_click=self._apply).props("outline"), "apply")
                testid(ui.button("Discard edits", on_click=self._discard).props("flat"), "discard")

    def preview_panel(self) -> None:
        """Show the panel with the triples whose state the edits would change."""
        with panel("Triples whose state would change") as heading:
            explain(heading, "The 30 triples are reduced to cognitive states by the scoring table (section III-C).")
            self._summary = text("", "", "triples-summary").props('role="status"')
            self._triples = DataTable(
                "triples", "Triples whose state would change", ("triple", "before", "after"), True
            )

    # --- the elements ---

    def _grid(self, study: Study) -> None:
        strategies = list(study.scoring.strategies)
        with ui.element("table").classes("scoring-grid").props('aria-label="Scoring table"'):
            with ui.element("thead"), ui.element("tr"):
                text("observation", tag="th")
                for strategy in strategies:
                    text(strategy, tag="th").props("scope=col")
            with ui.element("tbody"):
                self._grid_row(study, "strategy weight", [f"strategy-weight-{s}" for s in strategies])
                for part, category in categories():
                    self._grid_row(study, f"{part} {category}", [table_name(category, s) for s in strategies])

    def _grid_row(self, study: Study, label: str, names: list[str]) -> None:
        paths = editable(study)
        with ui.element("tr"):
            text(label, tag="th").props("scope=row")
            for name in names:
                shown = f"{value_at(study, paths[name]):g}"
                with ui.element("td"):
                    box = ui.input(value=shown).props('dense outlined inputmode="decimal"')
                box.props["aria-label"] = f"{label}, {paths[name][-1] if name.startswith('table') else paths[name][2]}"
                self._inputs[name] = testid(box, name)
                self._shown[name] = shown

    # --- what a click does ---

    def _typed(self) -> dict[str, str]:
        """Return the content of the inputs that were edited."""
        typed = {name: str(box.value or "") for name, box in self._inputs.items()}
        return {name: value for name, value in typed.items() if value != self._shown[name]}

    def _preview(self) -> None:
        self._previewed = ()
        study = self._history.study()
        try:
            if study is not None:
                changed_states(study, scoring_patch(study, self._typed()))
        except ShiftError as e:
            show_error(e)

    async def _apply(self) -> None:
        study = self._history.study()
        if study is None:
            return
        try:
            patch = scoring_patch(study, self._typed())
        except ShiftError as e:
            show_error(e)
            return
        if not patch:
            ui.notify("No value was edited.", type="warning")
        elif await self._steering.configure(patch):
            ui.notify("The scoring table is changed. The next decision uses it.", type="positive")

    def _discard(self) -> None:
        for name, box in self._inputs.items():
            box.value = self._shown[name]

    # --- what changes ---

    def script(self) -> str:
        """Follow the newest configuration; return the JavaScript that shows what the edits would change."""
        config, study = self._history.configs.last(), self._history.study()
        if config is None or study is None:
            return ""
        if config.version != self._version:
            self._version = config.version
            self._follow(study)
        typed = self._typed()
        key = (config.version, tuple(typed.items()))
        if key == self._previewed:
            return ""
        self._previewed = key
        for name, box in self._inputs.items():
            box.classes(**({"add": "edited"} if name in typed else {"remove": "edited"}))
        return self._triples.script(self._rows(study, typed))

    def _follow(self, study: Study) -> None:
        """Show the configuration's values in the inputs that are not edited."""
        paths = editable(study)
        for name, box in self._inputs.items():
            edited = box.value != self._shown[name]
            self._shown[name] = f"{value_at(study, paths[name]):g}"
            if not edited:
                box.value = self._shown[name]

    def _rows(self, study: Study, typed: dict[str, str]) -> list[Row]:
        try:
            found = changed_states(study, scoring_patch(study, typed))
        except ShiftError as e:
            self._summary.text = e.detail
            return []
        edits = f"{len(typed)} edited {'value' if len(typed) == 1 else 'values'}"
        self._summary.text = f"{len(found)} of 30 triples would change ({edits})." if typed else "Nothing is edited."
        return [Row([f"{c.triple.capacity}/{c.triple.gaze}/{c.triple.awareness}", c.before, c.after]) for c in found]
