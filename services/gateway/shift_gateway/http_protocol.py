"""uvicorn's HTTP/1.1 protocol, in which an offer to change to HTTP/2 does not lose the request's body.

Java's standard client and ``curl --http2`` send ``Upgrade: h2c`` with their first request, and continue in HTTP/1.1 if
the server ignores the offer (RFC 9110, 7.8). httptools assumes that every offered upgrade happens: it takes the bytes
after the headers for another protocol, and the body is lost. Such a request is parsed again without the offer.
Upgrades to WebSocket are not affected.
"""

from __future__ import annotations

import asyncio
from array import array
from typing import Any

import httptools
from uvicorn.config import Config
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
from uvicorn.server import ServerState

_OFFERED = (b"upgrade", b"http2-settings")


class _Parser(httptools.HttpRequestParser):
    """A parser that returns an upgrade to the protocol, unless it is an upgrade to WebSocket."""

    def __init__(self, protocol: GatewayProtocol) -> None:
        super().__init__(protocol)
        self.protocol = protocol

    def feed_data(self, data: bytes | bytearray | memoryview[int] | array[int]) -> None:
        try:
            super().feed_data(data)
        except httptools.HttpParserUpgrade as upgrade:
            if self.protocol.takes_upgrade():
                raise
            self.protocol.parse_again(bytes(data[upgrade.args[0] :]))


class GatewayProtocol(HttpToolsProtocol):
    """One connection. Pass the class to uvicorn as ``http``."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self.parser = self._new_parser()

    def takes_upgrade(self) -> bool:
        """Return whether the current request becomes a WebSocket."""
        return self._should_upgrade()

    def parse_again(self, rest: bytes) -> None:
        """Parse the current request as if it had not offered an upgrade; ``rest`` follows its headers."""
        head = self._head_without_offer()
        self.parser = self._new_parser()
        self.parser.feed_data(head + rest)

    def on_headers_complete(self) -> None:
        """Start the request, unless it is parsed again."""
        if not self._offers():
            super().on_headers_complete()

    def on_message_complete(self) -> None:
        """End the request's body, unless it is parsed again."""
        if not self._offers():
            super().on_message_complete()

    def _offers(self) -> bool:
        return bool(self.parser.should_upgrade()) and not self._should_upgrade()

    def _new_parser(self) -> _Parser:
        parser = _Parser(self)
        parser.set_dangerous_leniencies(lenient_data_after_close=True)  # as uvicorn's own parser
        return parser

    def _head_without_offer(self) -> bytes:
        version = self.parser.get_http_version().encode()
        lines = [self.parser.get_method() + b" " + self.url + b" HTTP/" + version]
        for name, value in self.headers:
            if name == b"connection":
                value = b", ".join(t for t in value.split(b",") if t.strip().lower() not in _OFFERED)
            if name not in _OFFERED and (value or name != b"connection"):
                lines.append(name + b": " + value)
        return b"\r\n".join([*lines, b"", b""])
