"""The replays that run, with their control: pause, rate, seek, step and stop."""

from __future__ import annotations

from nicegui import ui
from shift_schemas.errors import ShiftError
from shift_schemas.messages import ReplayControl, ReplayStatus

from shift_gateway.gateway import Gateway
from shift_gateway.web.layout import explain, show_error, testid, text

UPDATE_S = 1.0
"""How often the panel asks for the replays; chosen, as a control answers at once."""
RATES = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0)


class ReplayPanel:
    """One row for each replay that runs; nothing without one."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._rows: dict[str, ReplayRow] = {}
        self._panel = ui.element("section").classes("panel").props('aria-label="Replays that run"')
        self._panel.set_visibility(False)
        with self._panel:
            text("Replays that run", tag="h2")
        ui.timer(UPDATE_S, self.update)

    async def update(self) -> None:
        """Ask for the replays, and show them."""
        found = {status.session: status for status in await self._gateway.mesh.replays()}
        for session in [name for name in self._rows if name not in found]:
            self._rows.pop(session).remove()
        for session, status in found.items():
            if session not in self._rows:
                with self._panel:
                    self._rows[session] = ReplayRow(self._gateway, status)
            self._rows[session].show(status)
        self._panel.set_visibility(bool(found))


class ReplayRow:
    """The elements of one replay."""

    def __init__(self, gateway: Gateway, status: ReplayStatus) -> None:
        self._gateway, self._session = gateway, status.session
        self._status = status
        name = status.session
        with ui.element("div").classes("bar") as self._row:
            self._text = text("", "", f"replay-{name}")
            self._toggle = ui.button("Pause", on_click=self._on_toggle).props("outline dense no-caps")
            testid(self._toggle, f"replay-toggle-{name}")
            step = ui.button("Step", on_click=lambda: self._do(ReplayControl(step=True))).props("outline dense no-caps")
            explain(testid(step, f"replay-step-{name}"), "Pauses, and replays one more message.")
            self._rate = ui.select({r: f"{r:g} x" for r in RATES}, label="rate", on_change=self._on_rate)
            testid(self._rate.props("dense outlined"), f"replay-rate-{name}")
            self._seek = ui.number("go to, s", min=0, max=status.length_s).props("dense outlined")
            testid(self._seek, f"replay-seek-{name}")
            self._seek.on("keydown.enter", self._on_seek)
            explain(self._seek, "Enter goes to this second of the recording.")
            stop = ui.button("Stop", on_click=lambda: self._do(ReplayControl(stop=True))).props("outline dense no-caps")
            testid(stop, f"replay-stop-{name}")
        self._seek.set_visibility(not status.inputs)

    def show(self, status: ReplayStatus) -> None:
        """Show how far the replay is."""
        self._status = status
        what = f"the inputs of {status.recording}" if status.inputs else status.recording
        at = f"{status.position_s:.1f} of {status.length_s:.1f} s, {status.rate:g} x"
        self._text.text = f"{status.session} replays {what}: {at}{', paused' if status.paused else ''}"
        self._toggle.text = "Continue" if status.paused else "Pause"

    def remove(self) -> None:
        """Take the row away: the replay has ended."""
        self._row.delete()

    async def _on_toggle(self) -> None:
        await self._do(ReplayControl(paused=not self._status.paused))

    async def _on_rate(self) -> None:
        if self._rate.value is not None:
            await self._do(ReplayControl(rate=float(self._rate.value)))

    async def _on_seek(self) -> None:
        if self._seek.value is not None:
            await self._do(ReplayControl(position_s=float(self._seek.value)))

    async def _do(self, control: ReplayControl) -> None:
        try:
            self.show(await self._gateway.mesh.control_replay(self._session, control))
        except ShiftError as e:
            show_error(e)
