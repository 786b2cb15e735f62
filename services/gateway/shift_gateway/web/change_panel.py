"""The list of changes, with the buttons that undo a configuration, withdraw an override or retract a marker."""

from __future__ import annotations

from typing import Any

from nicegui import ui
from shift_schemas.messages import Mark, SetOverride

from shift_gateway.web.change_list import LONGEST, REVERSE, change_rows, changes, undo_patch
from shift_gateway.web.charts import shortened
from shift_gateway.web.data_table import DataTable
from shift_gateway.web.desk_view import facts_so_far
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import explain
from shift_gateway.web.panels import panel
from shift_gateway.web.steering import Steering


class ChangePanel:
    """The list and what its buttons do."""

    def __init__(self, history: SessionHistory, steering: Steering) -> None:
        self._history = history
        self._steering = steering
        self._key: tuple[int, ...] = ()
        with panel("Changes", wide=True, anchor="change-list") as heading:
            explain(heading, "Configurations, overrides, markers and results that people entered, the newest first.")
            headings = ("time", "who", "change", "what", "now", "reverse")
            self._table = DataTable("changes", "Changes", headings, scrolls=True)
        ui.on(REVERSE, self._reverse)

    def script(self) -> str:
        """Return the JavaScript that shows the changes."""
        key = facts_so_far(self._history)
        if key == self._key:
            return ""
        self._key = key
        return self._table.script(change_rows(changes(self._history)))

    async def _reverse(self, event: Any) -> None:
        action, _, target = str(event.args).partition(" ")
        if action == "undo" and target.isdecimal():
            await self._undo(int(target))
        elif action == "withdraw":
            await self._withdraw(target)
        elif action == "retract":
            await self._retract(target)

    async def _undo(self, version: int) -> None:
        patch = undo_patch(self._history, version)
        if patch is None:
            ui.notify(f"Configuration {version} does not hold any more, so there is nothing to undo.", type="warning")
        elif await self._steering.configure(patch):
            ui.notify(f"Configuration {version} is undone.", type="positive")

    async def _withdraw(self, override_id: str) -> None:
        found = next((o for o in self._history.overrides.items if o.override_id == override_id), None)
        if found is not None and await self._steering.send(SetOverride, task=found.task, withdraws=override_id):
            ui.notify("The override is withdrawn.", type="positive")

    async def _retract(self, marker_id: str) -> None:
        found = next((m for m in self._history.markers.items if m.marker_id == marker_id), None)
        if found is None:
            return
        words = f"Retracted: {shortened(found.text, LONGEST)}"
        if await self._steering.send(Mark, text=words, retracts=marker_id):
            ui.notify("The marker is retracted. Both stay in the recording.", type="positive")
