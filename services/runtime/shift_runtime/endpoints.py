"""Addresses that a person writes: Zenoh endpoints (``tcp/127.0.0.1:7447``) and URLs of the gateway. Pure.

They are checked here before anything is opened. An error names the value, the rule and an example.
"""

from __future__ import annotations

from urllib.parse import urlsplit

from shift_schemas.errors import InvalidSettings, shorten

PROTOCOLS = ("tcp", "tls", "quic", "udp", "ws")
EXAMPLE = "tcp/127.0.0.1:7447"


def parse_endpoint(text: str, name: str = "the endpoint") -> tuple[str, int]:
    """Return host and port of a Zenoh endpoint, ``PROTOCOL/HOST:PORT``.

    Raises
    ------
    InvalidSettings
        ``text`` is not an endpoint. The sentence begins with ``name``, the flag or variable of the value.
    """
    protocol, _, rest = text.partition("/")
    host, _, port = rest.partition("?")[0].partition("#")[0].rpartition(":")
    if protocol not in PROTOCOLS or not host or not _is_port(port, least=0):
        raise InvalidSettings(
            f"{name} is {shorten(text)!r}: an endpoint is PROTOCOL/HOST:PORT, such as {EXAMPLE}; "
            f"PROTOCOL is one of {', '.join(PROTOCOLS)}, PORT a number up to 65535"
        )
    return host.strip("[]"), int(port)


def check_url(text: str, name: str = "the gateway's URL") -> str:
    """Return the gateway's URL without a slash at its end. Raise :class:`InvalidSettings` if it is not a URL."""
    try:
        parts = urlsplit(text)
        valid = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is not a number up to 65535, or a bracket that is not closed
        valid = False
    if not valid or any(c.isspace() for c in text):
        raise InvalidSettings(
            f"{name} is {shorten(text)!r}: write http:// or https://, the host and the port, "
            "such as http://127.0.0.1:8080"
        )
    return text.rstrip("/")


def _is_port(text: str, least: int) -> bool:
    return text.isascii() and text.isdigit() and least <= int(text[:6]) <= 65535
