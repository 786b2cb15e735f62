"""ASGI middleware around the whole application: hosts and origins, CORS for named origins, and security headers."""

from __future__ import annotations

from shift_schemas.errors import ShiftError
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from shift_gateway.origins import RequestOrigin, Rules
from shift_gateway.problems import problem_response

CORS_METHODS = ("GET", "HEAD", "POST", "PATCH", "OPTIONS")
CORS_HEADERS = ("Authorization", "Cache-Control", "Content-Type", "Last-Event-ID", "Range")
EXPOSED_HEADERS = ("Allow", "Content-Disposition", "Content-Range", "Retry-After")
MAX_AGE_S = 600
"""How long a browser may remember the answer to a preflight, seconds. Chromium remembers it for 2 hours at most."""
SECURITY_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),  # with no-referrer, forms of our own page would have the origin null
    (b"cross-origin-resource-policy", b"same-origin"),
)
NO_PAGE = (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'")
"""The policy of every answer that is not one of our pages; a page has its own."""


class Guard:
    """Pass on the requests that :class:`Rules` allow; answer the others with a problem document."""

    def __init__(self, app: ASGIApp, rules: Rules) -> None:
        self._app = app
        self._rules = rules
        self._cors = CORSMiddleware(
            app, allow_origins=rules.origins, allow_methods=CORS_METHODS, allow_headers=CORS_HEADERS,
            expose_headers=EXPOSED_HEADERS, max_age=MAX_AGE_S, allow_private_network=True,
        )  # fmt: skip

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request or WebSocket handshake."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        if scope["type"] == "http":
            send = self._secured(send)
        try:
            named = self._rules.check(_origin_of(scope))
        except ShiftError as e:
            await _refuse(e, scope, receive, send)
            return
        await (self._app if named is None else self._cors)(scope, receive, send)

    def _secured(self, send: Send) -> Send:
        async def secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = message["headers"] = [*message["headers"], *SECURITY_HEADERS]
                if not any(name == NO_PAGE[0] for name, _ in headers):
                    headers.append(NO_PAGE)
                if self._rules.origins and not any(name == b"vary" for name, _ in headers):
                    headers.append((b"vary", b"Origin"))
            await send(message)

        return secured


def _origin_of(scope: Scope) -> RequestOrigin:
    hosts: list[str] = []
    origins: list[str] = []
    site = mode = ""
    for name, value in scope["headers"]:
        if name == b"host":
            hosts.append(value.decode("latin-1"))
        elif name == b"origin":
            origins.append(value.decode("latin-1"))
        elif name == b"sec-fetch-site":
            site = value.decode("latin-1")
        elif name == b"sec-fetch-mode":
            mode = value.decode("latin-1")
    server = (scope.get("server") or ("",))[0]
    return RequestOrigin(scope.get("method", "GET"), tuple(hosts), tuple(origins), site, mode, server)


async def _refuse(error: ShiftError, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer with the error. A WebSocket's handshake gets an HTTP answer if the server supports it."""
    response = problem_response(error)
    if scope["type"] == "http":
        await response(scope, receive, send)
        return
    await receive()
    if "websocket.http.response" in scope.get("extensions", {}):
        start = {"status": response.status_code, "headers": response.raw_headers}
        await send({"type": "websocket.http.response.start", **start})
        await send({"type": "websocket.http.response.body", "body": response.body})
    else:
        await send({"type": "websocket.close", "code": 1008, "reason": error.title})
