"""A study at ``/study/NAME``: its AOIs, its scoring table, its triples, and an editor."""

from __future__ import annotations

import asyncio
from pathlib import Path

from nicegui import ui
from shift_recording.durable_file import write_durably
from shift_runtime.study_files import find_study, study_names, study_text, unknown_study
from shift_schemas.errors import ShiftError
from shift_schemas.ids import ID_RULE, is_id
from shift_study.loading import study_in_force
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.layout import Frame, explain, show_error, testid, text
from shift_gateway.web.room_elements import stimulus_svg
from shift_gateway.web.study_view import OWN_VALUES, CheckedText, checked_text, table_rows, triple_rows

COLUMNS = ("triple", "scores", "strategy", "state")
CHECK_AFTER_S = 0.4
"""How long the editor must be quiet before its text is checked, seconds; chosen."""


def add_study_page(gateway: Gateway) -> None:
    """Add the page."""
    folder = gateway.settings.data / "studies"

    @ui.page("/study/{name}")
    async def study(name: str) -> None:
        Frame(f"Study {name[:70]}")
        await ui.context.client.connected()
        try:
            found = await asyncio.to_thread(study_text, name, folder) if is_id(name) else None
        except ShiftError as e:
            text(e.detail, "page")
            return
        if found is None:
            await _unknown(name, folder)
            return
        page = StudyPage(folder, name, found)
        await page.check()


async def _unknown(name: str, folder: Path) -> None:
    text(f"study {name[:70]!r}: {await asyncio.to_thread(unknown_study, name[:70], folder)}", "page")
    with ui.element("div").classes("page"):
        for known in await asyncio.to_thread(study_names, folder):
            ui.link(known, f"/study/{known}")


class StudyPage:
    """The elements of one open study."""

    def __init__(self, folder: Path, name: str, found: str) -> None:
        self._folder = folder
        self._name = name
        self._checking: asyncio.Task[None] | None = None
        self._study: Study | None = None
        with ui.element("div").classes("page"):
            with ui.element("div").classes("bar"):
                text(f"Study {name}", tag="h1")
                self._title = text("", "muted", "study-title")
            with ui.element("div").classes("columns even"):
                self._shown()
                self._editing(found)
            self._all_triples()

    # --- the elements ---

    def _shown(self) -> None:
        with ui.element("div").classes("form"):
            self._condition = ui.select([OWN_VALUES], value=OWN_VALUES, label="Condition", on_change=self._show)
            testid(self._condition.props("dense outlined options-dense"), "study-condition")
            with ui.element("section").classes("panel"):
                text("Areas of interest", tag="h2")
                self._aois = testid(ui.element("div").classes("stimulus study"), "study-aois")
            with ui.element("section").classes("panel"):
                text("Scoring table (paper, Table I)", tag="h2")
                self._table = testid(ui.table(rows=[], row_key="category").props("flat dense"), "study-table")

    def _editing(self, found: str) -> None:
        with ui.element("section").classes("panel form"):
            text("The study file (docs/study.md)", tag="h2")
            text("A change here changes nothing until it is saved under a name.", "muted")
            self._editor = ui.codemirror(found, language="YAML", on_change=self._on_change, line_wrapping=True)
            testid(self._editor.classes("editor"), "study-editor")
            self._remarks = testid(ui.element("div").classes("lines").props('role="status"'), "study-mistakes")
            with ui.element("div").classes("bar"):
                self._save_name = ui.input("Save as", value=f"{self._name}-2", on_change=self._on_change)
                testid(self._save_name.props("dense outlined"), "study-save-name")
                self._replace = ui.checkbox("replace an existing file")
                explain(self._replace, "Sessions that run keep the study that they began with.")
                testid(ui.button("Save", on_click=self._save).props("outline"), "study-save")

    def _all_triples(self) -> None:
        with ui.element("section").classes("panel"):
            text("The 30 triples: capacity / gaze / awareness", tag="h2")
            columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in COLUMNS]
            self._triples = ui.table(rows=[], columns=columns, row_key="triple").props("flat dense")
            testid(self._triples.classes("sessions"), "study-triples")

    # --- the text ---

    @property
    def _new_name(self) -> str:
        return str(self._save_name.value or "").strip()

    def _on_change(self) -> None:
        if self._checking is not None:
            self._checking.cancel()
        self._checking = asyncio.create_task(self._check_later())

    async def _check_later(self) -> None:
        await asyncio.sleep(CHECK_AFTER_S)
        await self.check()

    async def check(self) -> CheckedText:
        """Check the editor's text, and show the mistakes, or the study."""
        checked = await asyncio.to_thread(checked_text, str(self._editor.value or ""), self._new_name)
        self._remarks.clear()
        with self._remarks:
            if not any(r.is_mistake for r in checked.remarks):
                text("No mistakes.", "ok")
            for remark in checked.remarks:
                where = f"line {remark.line}: " if remark.line else ""
                line = text(f"{where}{remark.sentence}", "warning" if remark.is_mistake else "muted")
                if remark.line:
                    line.classes("jump").on("click", lambda n=remark.line: self._jump(n))
        if checked.study is not None:
            self._study = checked.study
            self._title.text = checked.study.title
            conditions = [OWN_VALUES, *checked.study.conditions]
            chosen = self._condition.value if self._condition.value in conditions else OWN_VALUES
            self._condition.set_options(conditions, value=chosen)
            self._show()
        return checked

    def _jump(self, line: int) -> None:
        ui.run_javascript(f"shift.jump({self._editor.id}, {line})")

    def _show(self) -> None:
        if self._study is None:
            return
        chosen = None if self._condition.value == OWN_VALUES else str(self._condition.value)
        study = study_in_force(self._study, chosen)
        self._aois.clear()
        with self._aois:
            ui.html(stimulus_svg(study), sanitize=False)
        rows = table_rows(study)
        self._table.columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in rows[0]]
        self._table.rows = rows
        self._triples.rows = triple_rows(study)

    async def _save(self) -> None:
        name = self._new_name
        if not is_id(name):
            ui.notify(f"{name[:70]!r} cannot be a study's name: {ID_RULE}", type="warning", multi_line=True)
            return
        checked = await self.check()
        if checked.study is None:
            ui.notify("The study has mistakes; it is not saved.", type="warning")
            return
        existing = await asyncio.to_thread(find_study, name, self._folder)
        if existing is not None and not self._replace.value:
            ui.notify(f"There is a study {name} already; choose another name, or allow to replace it.", type="warning")
            return
        try:
            await asyncio.to_thread(write_durably, self._folder / f"{name}.yaml", str(self._editor.value).encode())
        except ShiftError as e:
            show_error(e)
            return
        ui.notify(f"Saved: sessions can be started with {name}.", type="positive")
