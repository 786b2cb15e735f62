"""A page of a running session: it opens the session's history, updates four times a second, and closes it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from nicegui import ui
from shift_schemas.errors import ShiftError, check_id

from shift_gateway.gateway import Gateway
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import text
from shift_gateway.web.live_histories import LiveHistories

UPDATE_S = 0.2
"""The time between two updates of an open page, seconds; at least four a second are wanted."""


class LiveElements(Protocol):
    """The elements of a view of one session."""

    def update(self) -> str:
        """Show the present; return the JavaScript that the browser runs."""


async def live_session_page(
    gateway: Gateway, histories: LiveHistories, name: str, build: Callable[[SessionHistory], LiveElements]
) -> None:
    """Show a session until the browser leaves.

    ``build`` makes the elements from the session's history, which is read once the browser is connected: a program that
    only fetches the page costs nothing.
    """
    client = ui.context.client
    waiting = text(f"Reading session {name[:63]} …", "page")
    await client.connected()
    try:
        history = await histories.open(check_id("session", name))
    except ShiftError as e:
        waiting.text = e.detail
        ui.link("All sessions", "/").classes("page")
        return
    client.on_delete(lambda: histories.close(name))
    waiting.delete()
    elements = build(history)

    def update() -> None:
        script = elements.update()
        if not gateway.read_model.reader.unreached:
            script = f"shift.heard({gateway.api.clock.now().ns // 1_000_000}); {script}"
        ui.run_javascript(script)

    ui.timer(UPDATE_S, update)
