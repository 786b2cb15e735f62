"""The panel of a recording that verifies it: one button, with progress and cancel."""

from __future__ import annotations

import asyncio
from contextlib import aclosing
from pathlib import Path

from nicegui import ui

from shift_gateway.web.layout import explain, testid, text
from shift_gateway.web.panels import panel
from shift_gateway.web.recording_verification import WORK, VerifyResult
from shift_gateway.web.worker_process import Progress, WorkFailed, parts_of

EXPLANATION = (
    "Every output is derived again from the recorded inputs, and compared. "
    "This is what shift-mesh verify does (docs: recording)."
)


class VerifyPanel:
    """The elements of the panel."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._work: asyncio.Task[None] | None = None
        with panel("Verification"):
            with ui.element("div").classes("bar"):
                self._button = testid(ui.button("Verify", on_click=self._start).props("outline"), "verify")
                explain(self._button, EXPLANATION)
                self._cancel = testid(ui.button("Cancel", on_click=self._stop).props("flat"), "verify-cancel")
                self._result = text("", "", "verify-result").props('role="status"')
            self._bar = ui.linear_progress(0, show_value=False).props('aria-label="Verified"')
            self._details = text("", "muted")
        self._running(False)
        ui.context.client.on_delete(self._stop)

    def _running(self, running: bool) -> None:
        self._cancel.set_visibility(running)
        self._bar.set_visibility(running)
        self._button.set_enabled(not running)

    def _start(self) -> None:
        self._result.text = self._details.text = ""
        self._bar.value = 0
        self._running(True)
        self._work = asyncio.create_task(self._verify())

    def _stop(self) -> None:
        if self._work is not None:
            self._work.cancel()

    async def _verify(self) -> None:
        try:
            async with aclosing(parts_of(WORK, str(self._path))) as parts:
                async for part in parts:
                    if isinstance(part, Progress):
                        self._bar.value = round(part.share, 3)
                    elif isinstance(part, VerifyResult):
                        self._show(part)
        except WorkFailed as e:
            self._result.text = f"The verification could not be completed: {e.detail}."
        except asyncio.CancelledError:
            self._result.text = "The verification was cancelled."
        finally:
            self._running(False)

    def _show(self, result: VerifyResult) -> None:
        self._result.classes(replace="ok" if result.ok else "fault")
        self._result.text = result.sentence
        self._details.text = result.details
