"""One recording at ``/recordings/NAME``: its time line, and the room's and the desk's views at the time of a cursor."""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path
from typing import Any

from nicegui import ui
from shift_recording.replay import Pacer
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.recordings import recording_path
from shift_gateway.web.data_table import DataTable
from shift_gateway.web.desk_elements import DeskElements
from shift_gateway.web.layout import Frame, explain, testid, text
from shift_gateway.web.recording_history import RecordingHistory, read_history
from shift_gateway.web.recording_view import (
    SEEK,
    event_rows,
    events,
    recording_head,
    timeline_height,
    timeline_options,
)
from shift_gateway.web.recordings_page import exclusions_of
from shift_gateway.web.recordings_view import exclusion_text
from shift_gateway.web.room_elements import GazeSources, RoomElements, stimulus_script
from shift_gateway.web.room_view import room_view
from shift_gateway.web.table_rows import Row
from shift_gateway.web.verify_panel import VerifyPanel
from shift_gateway.web.whatif_panel import WhatIfPanel
from shift_gateway.web.wording import duration

UPDATE_S = 0.2
"""The time between two updates while the recording plays, seconds."""
RATES = {0.25: "0.25", 0.5: "0.5", 1: "1", 2: "2", 5: "5", 10: "10", 30: "30"}
"""Recorded seconds in one second, and how they are shown."""
TIMELINE = (
    "Capacity and focus shift, cognitive state and strategy of each decision, rewards. Triangles: markers. "
    "Grey: no valid gaze. Press a place to see the session at that time."
)


def add_recording_page(gateway: Gateway) -> None:
    """Add the page."""

    @ui.page("/recordings/{name}")
    async def recording(name: str) -> None:
        Frame(f"Recording {name[:80]}")
        client = ui.context.client
        main = ui.element("main").classes("page")
        with main:
            heading = text(name[:80], tag="h1")
            path = recording_path(gateway.recordings, name) if name.endswith(".mcap") else None
            if path is None:
                heading.text = f"There is no recording {name[:80]}."
                text("A session has its recording when it has ended.")
                ui.link("All recordings", "/recordings")
                return
        await client.connected()
        loading = asyncio.create_task(_load(path, main, heading, gateway.settings.data / "studies"))
        client.on_delete(loading.cancel)


async def _load(path: Path, main: ui.element, heading: ui.label, studies: Path) -> None:
    """Read the recording with a progress bar, then show it."""
    with main:
        label = text("Reading the recording …", "muted").props('role="status"')
        bar = ui.linear_progress(0, show_value=False).props('aria-label="Recording read"')
    recording = RecordingHistory()

    def on_progress(share: float) -> None:
        bar.value = share

    await read_history(path, recording, on_progress)
    excluded = exclusion_text((await asyncio.to_thread(exclusions_of, path.parent, [path.name]))[path.name])
    drawn = await asyncio.to_thread(lambda: (timeline_options(recording), event_rows(events(recording))))
    label.delete()
    bar.delete()
    heading.delete()
    with main:
        RecordingPage(path, recording, excluded, *drawn, studies)


class RecordingPage:
    """The elements of one open recording."""

    def __init__(
        self, path: Path, recording: RecordingHistory, excluded: str, options: Any, rows: list[Row], studies: Path
    ) -> None:
        self._path = path
        self._recording = recording
        self._history = recording.history
        self._pacer = Pacer(1.0, time.monotonic, paused=True)
        self._shown_s = -1.0
        self._typing = False
        self._head(excluded)
        if recording.length_s:
            self._playback()
            self._timeline_panel(options, rows)
            self._views(self._history.study() or Study(study="default"))
            self._timer = ui.timer(UPDATE_S, self._tick, active=False)
            ui.on(SEEK, lambda event: self._seek(event.args))
            self._show()
        VerifyPanel(path)
        WhatIfPanel(path, studies)

    # --- the elements ---

    def _head(self, excluded: str) -> None:
        head = recording_head(self._recording, self._path.name)
        with ui.element("header").classes("bar"):
            text(head.title, tag="h1")
            ui.element("span").classes("grow")
            link = ui.link("Download", f"/v1/recordings/{self._path.name}").props(f'download="{self._path.name}"')
            testid(link, "download")
            ui.link("All recordings", "/recordings")
        text(head.facts, "muted", "recording-facts")
        if self._recording.reason:
            text(f"This recording is not whole: {self._recording.reason}.", "fault", "recording-reason")
        if excluded:
            text(f"Excluded from the analysis: {excluded}", "warning", "recording-exclusion")

    def _playback(self) -> None:
        length = self._recording.length_s
        with ui.element("div").classes("bar playback"):
            testid(ui.button("Play", on_click=self._play).props("outline"), "play")
            testid(ui.button("Pause", on_click=self._pause).props("outline"), "pause")
            self._slider = ui.slider(min=0, max=round(length, 1), step=0.1, value=0, on_change=self._on_slider)
            self._slider.props('aria-label="Position, s"')
            self._number = ui.number("Position, s", value=0, min=0, step=1, format="%.1f", on_change=self._on_number)
            self._number.props("dense outlined").style("width: 8rem")
            self._number.on("focus", lambda: self._set_typing(True)).on("blur", lambda: self._set_typing(False))
            testid(self._number, "seek")
            self._rate = ui.select(RATES, value=1, label="Rate", on_change=self._on_rate)
            testid(self._rate.props("dense outlined options-dense").style("min-width: 6rem"), "rate")
            self._position = text("", "", "position")

    def _timeline_panel(self, options: dict[str, Any], rows: list[Row]) -> None:
        with ui.element("section").classes("panel timeline").props('aria-label="Time line"'):
            with ui.element("div").classes("bar"):
                explain(text("Time line", tag="h2"), TIMELINE)
                ui.element("span").classes("grow")
                testid(ui.button("Save as SVG", on_click=self._save).props("outline dense"), "save-svg")
            self._chart = ui.echart(options, renderer="svg").style(f"height: {timeline_height(options)}px")
            testid(self._chart, "timeline")
        with ui.element("section").classes("panel").props('aria-label="Events"'):
            text("Events", tag="h2")
            table = DataTable("events", "Events of the session", ("time", "kind", "what"), scrolls=True)
        ui.run_javascript(f"shift.timeline({self._chart.id}); {table.script(rows)}")

    def _views(self, study: Study) -> None:
        self._room = RoomElements(study)
        with ui.element("div").classes("bar"):
            text("At this time", tag="h2")
            text("decision ", "muted", tag="span")
            self._room.add_text("decision-number", tag="span")
            ui.element("span").classes("grow")
            self._sources = GazeSources()
        with ui.element("div").classes("recording-views"):
            self._room.add_say()
            self._room.add_state()
            self._room.add_person()
        with ui.element("div").classes("desk"):
            self._desk = DeskElements(self._history, self._select)

    # --- the cursor ---

    def _play(self) -> None:
        if self._pacer.position_s >= self._recording.length_s:
            self._pacer.seek(0)
        if self._pacer.paused:
            self._pacer.toggle()
        self._timer.activate()

    def _pause(self) -> None:
        if not self._pacer.paused:
            self._pacer.toggle()
        self._timer.deactivate()
        self._show()

    def _tick(self) -> None:
        if self._pacer.position_s >= self._recording.length_s:
            self._pacer.seek(self._recording.length_s)
            self._pause()
        else:
            self._show()

    def _seek(self, position_s: Any) -> None:
        if isinstance(position_s, (int, float)):
            self._pacer.seek(min(max(float(position_s), 0.0), self._recording.length_s))
            self._show()

    def _select(self, n: int) -> None:
        self._desk.selected = n
        self._shown_s = -1.0
        self._show()

    def _on_slider(self, event: Any) -> None:
        if event.value is not None and abs(event.value - self._shown_s) >= 0.1:
            self._seek(event.value)

    def _on_number(self, event: Any) -> None:
        if event.value is not None and abs(event.value - round(self._shown_s, 1)) > 1e-6:
            self._seek(event.value)

    def _on_rate(self, event: Any) -> None:
        self._pacer.change_rate(float(event.value))

    def _set_typing(self, typing: bool) -> None:
        self._typing = typing

    def _save(self) -> None:
        name = json.dumps(f"{self._path.stem}-timeline.svg")
        ui.run_javascript(f"shift.saveSvg({self._chart.id}, {name}, {self._shown_s:.3f})")

    def _show(self) -> None:
        """Show the session at the cursor's time."""
        position_s = min(self._pacer.position_s, self._recording.length_s)
        if position_s == self._shown_s:
            return
        self._shown_s = position_s
        at_ns = self._recording.at_ns(position_s)
        view = room_view(self._history, at_ns, at_ns)
        self._room.show(view)
        self._sources.show(view.sources)
        self._slider.value = round(position_s, 1)
        if not self._typing or self._pacer.paused:
            self._number.value = round(position_s, 1)
        self._position.text = f"{duration(position_s)} of {duration(self._recording.length_s)}"
        cursor = f"shift.cursor({self._chart.id}, {position_s:.3f}); "
        ui.run_javascript(cursor + stimulus_script(view) + self._desk.script(at_ns, at_ns))
