"""A recording at ``/recordings/NAME``: its time line, and the room's and the desk's views at the cursor's time."""

from __future__ import annotations

import asyncio
import time
from contextlib import aclosing
from pathlib import Path

from nicegui import ui
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.recordings import recording_path
from shift_gateway.web.desk_elements import DeskElements
from shift_gateway.web.layout import Frame, explain, testid, text
from shift_gateway.web.recording_history import RecordingHistory, read_history
from shift_gateway.web.recording_verification import WORK, VerifyResult
from shift_gateway.web.recording_view import (
    LINKED,
    events,
    recording_head,
    timeline_height,
    timeline_options,
)
from shift_gateway.web.room_elements import GazeSources, RoomElements, stimulus_script
from shift_gateway.web.room_view import room_view
from shift_gateway.web.wording import duration
from shift_gateway.web.worker_process import Progress, WorkFailed, parts_of

RATES = (0.5, 1, 2, 5, 10, 30)
TICK_S = 0.2
"""The time between two positions while a recording is played, seconds."""
EVENT_COLUMNS = {"at": "time from the session's start", "kind": "kind of event", "what": "what happened"}


def add_recording_page(gateway: Gateway) -> None:
    """Add the page."""

    @ui.page("/recordings/{name}")
    async def recording(name: str) -> None:
        Frame(f"Recording {name[:70]}")
        client = ui.context.client
        await client.connected()
        path = recording_path(gateway.recordings, name)
        if path is None or path.suffix != ".mcap":
            text(f"there is no recording {name[:80]}", "page")
            ui.link("All recordings", "/recordings").classes("page")
            return
        page = RecordingPage(path)
        loading = asyncio.create_task(page.load())
        client.on_delete(loading.cancel)
        client.on_delete(page.close)


class RecordingPage:
    """The elements of one open recording."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._recording = RecordingHistory()
        self._verification = Verification(path)
        with ui.element("div").classes("page") as self._main:
            text(path.name, tag="h1")
            self._facts = text("", "muted")
            self._state = text(f"Reading {path.name} …", "muted", "reading").props('role="status"')
            self._progress = ui.linear_progress(0, show_value=False).props(
                'aria-label="Share of the file that is read"'
            )

    async def load(self) -> None:
        """Read the file in a process of its own, and then show it."""

        def on_progress(share: float) -> None:
            self._progress.value = share

        await read_history(self._path, self._recording, on_progress)
        with self._main:
            self._progress.delete()
            self._facts.text = recording_head(self._recording, self._path.name).facts
            self._state.text = f"Not complete: {self._recording.reason}." if self._recording.reason else ""
            self._verification.draw(self._path.name)
            self._player = Player(self._recording, self._path.stem)

    def close(self) -> None:
        """Stop what runs: the page is closed."""
        self._verification.cancel()


class Verification:
    """The button that verifies the recording, its progress and its result."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._task: asyncio.Task[None] | None = None

    def draw(self, name: str) -> None:
        """Draw the buttons."""
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("bar"):
                self._button = testid(ui.button("Verify", on_click=self._start).props("outline"), "verify")
                explain(
                    self._button, "Derive every output again from the recorded inputs, and compare (docs/recording.md)."
                )
                self._cancel = ui.button("Cancel", on_click=self.cancel).props("flat")
                ui.element("span").classes("grow")
                link = ui.link("Download", f"/v1/recordings/{name}").props(f'download="{name}"')
                testid(link, "download")
            self._progress = ui.linear_progress(0, show_value=False).props('aria-label="Share that is verified"')
            self._result = text("", "", "verify-result").props('role="status"')
            self._details = text("", "muted")
        self._running(False)

    def _running(self, running: bool) -> None:
        self._button.set_enabled(not running)
        self._cancel.set_visibility(running)
        self._progress.set_visibility(running)

    def _start(self) -> None:
        self._running(True)
        self._result.text, self._details.text, self._progress.value = "", "", 0
        self._task = asyncio.create_task(self._run())

    def cancel(self) -> None:
        """End the verification, if one runs."""
        if self._task is not None:
            self._task.cancel()

    async def _run(self) -> None:
        try:
            async with aclosing(parts_of(WORK, str(self._path))) as parts:
                async for part in parts:
                    if isinstance(part, Progress):
                        self._progress.value = part.share
                    elif isinstance(part, VerifyResult):
                        self._result.text, self._details.text = part.sentence, part.details
        except WorkFailed as e:
            self._result.text = f"It could not be verified: {e.detail}."
        except asyncio.CancelledError:
            self._result.text = "The verification was cancelled."
        finally:
            self._running(False)


class Player:
    """The time line with its cursor, and the views at that time."""

    def __init__(self, recording: RecordingHistory, name: str) -> None:
        self._recording = recording
        self._position_s = 0.0
        self._played_from: float | None = None
        study = recording.history.study() or Study(study="default")
        self._length_s = recording.length_s
        self._timeline(name)
        self._controls()
        self._elements = RoomElements(study)
        self._room()
        with ui.element("div").classes("desk"):
            self._desk = DeskElements(recording.history, self._select)
        self._events()
        self._timer = ui.timer(TICK_S, self._tick, active=False)
        self._go(self._length_s)

    # --- the elements ---

    def _timeline(self, name: str) -> None:
        options = timeline_options(self._recording)
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("bar"):
                text("Time line", tag="h2")
                ui.element("span").classes("grow")
                ui.button("Save as SVG", on_click=lambda: self._save(name)).props("outline dense")
            self._chart = ui.echart(options, renderer="svg").style(f"height: {timeline_height(options)}px; width: 100%")
            testid(self._chart, "timeline")

    def _save(self, name: str) -> None:
        ui.run_javascript(f"shift.saveSvg({self._chart.id}, '{name}-time-line.svg')")

    def _controls(self) -> None:
        with ui.element("div").classes("bar panel"):
            testid(ui.button("Play", on_click=self._play).props("outline"), "play")
            testid(ui.button("Pause", on_click=self._pause).props("outline"), "pause")
            self._rate = ui.select({r: f"{r:g} ×" for r in RATES}, value=1, label="Rate").props("dense outlined")
            explain(testid(self._rate.style("min-width: 6rem"), "rate"), "Times real time.")
            self._seek = ui.number(
                "Position in s", min=0, max=round(self._length_s, 1), step=1, on_change=self._on_seek
            )
            testid(self._seek.props("dense outlined").style("width: 9rem"), "seek")
            self._slider = ui.slider(min=0, max=max(self._length_s, 0.1), step=0.1, on_change=self._on_slide)
            self._slider.classes("grow").props('aria-label="Position"')
            self._clock = text("", "")

    def _room(self) -> None:
        with ui.element("div").classes("recorded-room"):
            self._elements.add_say()
            with ui.element("div").classes("right"):
                self._elements.add_state()
                self._elements.add_person()
        with ui.element("div").classes("bar"):
            text("decision ", tag="span")
            self._elements.add_text("decision-number", tag="span")
            self._sources = GazeSources()

    def _events(self) -> None:
        columns = [{"name": n, "label": n, "field": n, "align": "left"} for n in EVENT_COLUMNS]
        rows = [
            {"key": i, "at": duration(e.position_s), "kind": e.kind, "what": e.what}
            for i, e in enumerate(events(self._recording))
        ]
        with ui.element("section").classes("panel"):
            text("Events", tag="h2")
            table = ui.table(columns=columns, rows=rows, row_key="key", pagination=20).props("flat dense wrap-cells")
            testid(table.classes("sessions"), "events")

    # --- play, pause, seek ---

    def _play(self) -> None:
        if self._position_s >= self._length_s:
            self._go(0.0)
        self._played_from = time.monotonic()
        self._timer.activate()

    def _pause(self) -> None:
        self._played_from = None
        self._timer.deactivate()

    def _tick(self) -> None:
        now = time.monotonic()
        if self._played_from is None:
            return
        passed, self._played_from = now - self._played_from, now
        self._go(self._position_s + passed * float(self._rate.value or 1))
        if self._position_s >= self._length_s:
            self._pause()

    def _on_seek(self) -> None:
        if self._seek.value is not None and abs(float(self._seek.value) - round(self._position_s, 1)) > 0.05:
            self._go(float(self._seek.value))

    def _on_slide(self) -> None:
        if abs(float(self._slider.value) - round(self._position_s, 1)) > 0.05:
            self._go(float(self._slider.value))

    def _go(self, position_s: float) -> None:
        """Show the recording at a position."""
        self._position_s = min(max(position_s, 0.0), self._length_s)
        shown = round(self._position_s, 1)
        self._seek.value = self._slider.value = shown
        self._clock.text = f"{duration(self._position_s)} of {duration(self._length_s)}"
        at_ns = self._recording.at_ns(self._position_s)
        view = room_view(self._recording.history, at_ns, at_ns)
        self._elements.show(view)
        self._sources.show(view.sources)
        ui.run_javascript(
            stimulus_script(view)
            + f"shift.cursor({self._chart.id}, {shown}, {LINKED});"
            + self._desk.script(at_ns, at_ns)
        )

    def _select(self, n: int) -> None:
        """Explain a decision."""
        self._desk.selected = n
        self._go(self._position_s)
