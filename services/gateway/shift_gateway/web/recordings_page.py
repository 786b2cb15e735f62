"""The recordings at ``/recordings``: a table over sessions, and their exclusion from analysis."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from nicegui import run, ui
from shift_recording.exclusion import Exclusion, ExclusionEntry, add_entry, read_exclusion
from shift_schemas.errors import ShiftError

from shift_gateway.gateway import Gateway
from shift_gateway.recordings import recording_path
from shift_gateway.web.layout import Frame, explain, show_error, testid, text
from shift_gateway.web.recording_summary import WORK, RecordingSummary
from shift_gateway.web.recordings_view import COLUMNS, NO_STATISTICS, recording_row
from shift_gateway.web.replay_panel import ReplayPanel
from shift_gateway.web.worker_process import WorkFailed, parts_of

Key = tuple[str, int, int]
"""Name, size and time of change, ns: a file of which these are the same is not read again."""
CELL = """
<q-td :props="props" :data-testid="`${props.col.name}-${props.row.recording}`">
  <a v-if="props.col.name === 'recording'" :href="`/recordings/${props.row.recording}`">{{ props.value }}</a>
  <template v-else-if="props.col.name === 'exclusion'">
    <span>{{ props.value }} </span>
    <q-btn flat dense no-caps :label="props.row.excluded ? 'Take back…' : 'Exclude…'"
      :aria-label="(props.row.excluded ? 'Take back the exclusion of ' : 'Exclude ') + props.row.recording"
      :data-testid="`exclude-${props.row.recording}`" @click="$parent.$emit('exclude', props.row.recording)" />
  </template>
  <template v-else>{{ props.value }}</template>
</q-td>
"""
"""A cell of the table. Values are text: Vue does not interpret them."""
HEADING = """
<q-th :props="props">{{ props.col.label }}<q-tooltip :delay="400">{{ props.col.explanation }}</q-tooltip></q-th>
"""
NEWEST_FIRST = {"rowsPerPage": 50, "sortBy": "started", "descending": True}


class RecordingSummaries:
    """The summaries of the recordings. Each file is read once in a process of the gateway."""

    def __init__(self) -> None:
        self._known: dict[Key, RecordingSummary] = {}
        self._reading = asyncio.Lock()

    async def of(self, folder: Path) -> AsyncIterator[tuple[list[RecordingSummary], int]]:
        """Yield the summaries that are known, and the number of files, until all files are read. Raises WorkFailed."""
        keys = await asyncio.to_thread(_keys, folder)
        async with self._reading:
            self._known = {key: self._known[key] for key in keys if key in self._known}
            missing = [key for key in keys if key not in self._known]
            yield list(self._known.values()), len(keys)
            if not missing:
                return
            left = iter(missing)
            async for summary in parts_of(WORK, *(str(folder / key[0]) for key in missing)):
                self._known[next(left)] = summary
                yield list(self._known.values()), len(keys)


def _keys(folder: Path) -> list[Key]:
    files = sorted(folder.glob("*.mcap")) if folder.is_dir() else []
    found = [(path.name, path.stat()) for path in files if recording_path(folder, path.name)]
    return [(name, status.st_size, status.st_mtime_ns) for name, status in found]


def add_recordings_page(gateway: Gateway) -> None:
    """Add the page."""
    summaries = RecordingSummaries()

    @ui.page("/recordings")
    async def recordings() -> None:
        Frame("Recordings")
        page = RecordingsPage(gateway.recordings, gateway)
        client = ui.context.client
        await client.connected()
        loading = asyncio.create_task(page.load(summaries))
        client.on_delete(loading.cancel)


class RecordingsPage:
    """The elements of one open table."""

    def __init__(self, folder: Path, gateway: Gateway) -> None:
        self._folder = folder
        self._gateway = gateway
        self._summaries: list[RecordingSummary] = []
        self._exclusions: dict[str, Exclusion | str] = {}
        with ui.element("div").classes("page"):
            text("Recordings", tag="h1")
            text(NO_STATISTICS, "muted", "no-statistics")
            ReplayPanel(gateway)
            self._progress_text = text("", "muted", "reading").props('role="status"')
            self._progress = ui.linear_progress(0, show_value=False).props('aria-label="Recordings read"')
            self._progress.set_visibility(False)
            with ui.element("div").classes("bar"):
                self._filter = ui.input("Filter").props("dense outlined clearable")
                self._unblinded = ui.checkbox("show the conditions of blinded studies", on_change=self._show)
                explain(self._unblinded, "Whoever still collects data for such a study should leave this off.")
                testid(self._unblinded, "unblind")
            self._table = self._make_table()
        self._dialog = ExclusionDialog(gateway, folder, self._on_exclusion)

    def _make_table(self) -> ui.table:
        columns = [
            {"name": name, "label": label, "field": name, "sortable": True, "align": "left", "explanation": explanation}
            for name, label, explanation in COLUMNS
        ]
        table = ui.table(rows=[], columns=columns, row_key="recording", pagination=NEWEST_FIRST)
        table.props('flat bordered dense wrap-cells no-data-label="There is no recording yet."')
        table.classes("recordings")
        table.add_slot("body-cell", CELL)
        table.add_slot("header-cell", HEADING)
        table.bind_filter_from(self._filter, "value", backward=lambda value: value or "")
        table.on("exclude", self._ask)
        return testid(table, "recordings")

    async def load(self, summaries: RecordingSummaries) -> None:
        """Read the files that this process has not read yet, and show them as they come."""
        try:
            async for found, total in summaries.of(self._folder):
                self._summaries = found
                missing = [s.name for s in found if s.name not in self._exclusions]
                self._exclusions |= await asyncio.to_thread(exclusions_of, self._folder, missing)
                self._progress.value = len(found) / total if total else 1
                self._progress.set_visibility(len(found) < total)
                self._progress_text.text = f"{len(found)} of {total} recordings are read."
                self._show()
        except WorkFailed as e:
            self._progress_text.text = f"The recordings could not be read: {e.detail}."

    def _show(self) -> None:
        self._table.rows = [
            recording_row(s, self._exclusions.get(s.name, ""), bool(self._unblinded.value)) for s in self._summaries
        ]

    def _ask(self, event: Any) -> None:
        name = str(event.args)
        exclusion = self._exclusions.get(name)
        if isinstance(exclusion, Exclusion):
            self._dialog.ask(name, excluded=exclusion.in_force is not None)
        else:
            ui.notify(exclusion or f"there is no recording {name[:80]}", type="negative")

    def _on_exclusion(self, name: str, exclusion: Exclusion) -> None:
        self._exclusions[name] = exclusion
        self._show()


class ExclusionDialog:
    """Asks who excludes a recording, or takes the exclusion back, and why; and writes it."""

    def __init__(self, gateway: Gateway, folder: Path, on_exclusion: Any) -> None:
        self._gateway = gateway
        self._folder = folder
        self._on_exclusion = on_exclusion
        self._name = ""
        self._excludes = True
        with ui.dialog() as self._dialog, ui.card():
            self._title = text("", tag="h2")
            text("The recording does not change. The reason is kept beside it, with your name and the time.", "muted")
            self._reason = testid(ui.input("Reason"), "exclusion-reason").classes("dialog-field")
            self._author = testid(ui.input("Your name or initials"), "exclusion-author").classes("dialog-field")
            with ui.row():
                self._button = testid(ui.button("Exclude", on_click=self._write).props("outline"), "exclusion-confirm")
                ui.button("Cancel", on_click=self._dialog.close).props("flat")

    def ask(self, name: str, excluded: bool) -> None:
        """Open the dialog for a recording that is or is not excluded now."""
        self._name, self._excludes = name, not excluded
        self._title.text = f"Take back the exclusion of {name}" if excluded else f"Exclude {name} from the analysis"
        self._button.text = "Take back" if excluded else "Exclude"
        self._reason.value = ""
        self._dialog.open()

    async def _write(self) -> None:
        reason, author = str(self._reason.value or "").strip(), str(self._author.value or "").strip()
        if not author or not reason:
            ui.notify("Write the reason and your name.", type="warning")
            return
        path = recording_path(self._folder, self._name)
        if path is None:
            ui.notify(f"there is no recording {self._name[:80]}", type="negative")
            return
        entry = ExclusionEntry(
            excluded=self._excludes, reason=reason[:1000], author=author[:100], time=self._gateway.api.clock.now()
        )
        try:
            exclusion = await run.io_bound(add_entry, path, entry)
        except ShiftError as e:
            show_error(e)
            return
        if exclusion is not None:
            self._on_exclusion(self._name, exclusion)
        self._dialog.close()


def exclusions_of(folder: Path, names: list[str]) -> dict[str, Exclusion | str]:
    """Return the exclusion of each recording; a text if its file cannot be read."""
    found: dict[str, Exclusion | str] = {}
    for name in names:
        try:
            found[name] = read_exclusion(folder / name)
        except ShiftError as e:
            found[name] = e.detail
    return found
