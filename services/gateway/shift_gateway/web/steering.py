"""Commands that a person gives on the page: with the person's name, and with refusals shown."""

from __future__ import annotations

import json
from typing import Any

from nicegui import ui
from pydantic import BaseModel, ValidationError
from shift_schemas.errors import ShiftError, malformed
from shift_schemas.messages import Command, Configure, PatchBody
from shift_schemas.requests import body_type

from shift_gateway.gateway import Gateway
from shift_gateway.web.layout import explain, show_error, testid

LONGEST_NAME = 100
"""An author's name has at most this many characters."""


class Steering:
    """One person who steers one session. The browser keeps the person's name."""

    def __init__(self, gateway: Gateway, session: str) -> None:
        self._gateway = gateway
        self._session = session
        self._name: ui.input | None = None

    @property
    def author(self) -> str:
        """The name of the person; empty while it is not given."""
        return str(self._name.value or "").strip()[:LONGEST_NAME] if self._name is not None else ""

    def name_field(self) -> None:
        """Show the field for the name."""
        self._name = testid(ui.input("Your name").props(f"dense outlined maxlength={LONGEST_NAME}"), "author")
        self._name.on("blur", lambda: ui.run_javascript(f"shift.author({json.dumps(self.author)})"))
        explain(self._name, "It is recorded with each of your changes. This browser keeps it.")
        ui.timer(0.05, self._restore, once=True)

    async def _restore(self) -> None:
        kept = await ui.run_javascript("shift.author()")
        if self._name is not None and not self._name.value and isinstance(kept, str):
            self._name.value = kept[:LONGEST_NAME]

    async def send(self, kind: type[Command], **fields: Any) -> bool:
        """Give a command with these fields of its body; show a refusal. Return whether it was carried out."""
        try:
            body = body_type(kind)(**fields, author=self.author)
        except ValidationError as e:
            show_error(malformed(kind.procedure, e))
            return False
        return await self._carry_out(kind, body)

    async def configure(self, patch: dict[str, Any]) -> bool:
        """Change the study in force by a merge patch; show a refusal. Return whether it was changed."""
        return await self._carry_out(Configure, PatchBody(patch), author=self.author)

    async def _carry_out(self, kind: type[Command], body: BaseModel, **further: str) -> bool:
        try:
            await self._gateway.api.command(kind, self._session, body, **further)
        except ShiftError as e:
            show_error(e)
            return False
        return True
