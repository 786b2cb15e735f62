"""The routes of the web page. NiceGUI is imported at the first request for a page: the gateway starts without it."""

from __future__ import annotations

import asyncio
import importlib
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

from starlette.routing import BaseRoute, Match
from starlette.types import Message, Receive, Scope, Send

if TYPE_CHECKING:
    from shift_gateway.gateway import Gateway

PAGES = (
    "/session", "/recordings", "/study", "/evaluation", "/page-assets", "/page-stimulus", "/_nicegui", "/_nicegui_ws",
)  # fmt: skip
"""The first parts of the paths that the page has, besides ``/`` itself."""
POLICY = (
    b"content-security-policy",
    (
        b"default-src 'none'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'self'; "
        b"frame-ancestors 'none'"
    ),
)
"""NiceGUI's templates are compiled in the browser, and its start script is inline. No other host is ever asked."""


class PageRoute(BaseRoute):
    """All paths of the web page."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._loading: asyncio.Task[None] | None = None
        self._running = AsyncExitStack()

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Match the pages and their WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            return Match.NONE, {}
        path = scope["path"]
        is_page = path == "/" or any(path == p or path.startswith(p + "/") for p in PAGES)
        return (Match.FULL if is_page else Match.NONE), {}

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on to NiceGUI, which the first request loads. HEAD is answered as GET without its body."""
        await self.load()
        if scope.get("method") == "HEAD":
            scope = {**scope, "method": "GET"}

        async def with_policy(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), POLICY]
            await send(message)

        await self._app(scope, receive, with_policy)

    async def load(self) -> None:
        """Load NiceGUI and the pages, once. The import runs in a thread, so that other requests are answered."""
        if self._loading is None:
            self._loading = asyncio.create_task(self._load())
        await asyncio.shield(self._loading)

    async def close(self) -> None:
        """Stop NiceGUI, if it was loaded."""
        await self._running.aclose()

    async def _load(self) -> None:
        application = await asyncio.to_thread(importlib.import_module, "shift_gateway.web.application")
        self._app = application.make_pages(self._gateway)
        await self._running.enter_async_context(self._app.router.lifespan_context(self._app))
