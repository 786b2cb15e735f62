"""The hosts and origins that the gateway answers. Pure.

A browser sends requests for any web page that is open in it, also to 127.0.0.1. Two headers, which a page cannot forge,
distinguish these requests from the lab's own:

- ``Host``: the name in the address. A name that an attacker points at this machine (DNS rebinding) is a foreign one.
- ``Origin``: the page that asks. Browsers leave it out of some requests that only read; ``Sec-Fetch-Site`` then tells
  where the request comes from.

Programs that are not browsers send no ``Origin``, and are accepted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from ipaddress import IPv6Address, ip_address

from shift_schemas.errors import ShiftError, shorten

PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}
_HOST = re.compile(r"(?P<name>\[[0-9a-fA-F:.]+\]|[^\[\]:/?#@\s,]+)(?::(?P<port>[0-9]{1,5})?)?")
_READS = ("GET", "HEAD")


class WrongHost(ShiftError):
    """The request names a host that is not this gateway."""

    kind = "wrong-host"
    status = 421
    title = "The gateway does not answer under this host name"


class ForeignOrigin(ShiftError):
    """The request comes from a web page that may not use the gateway."""

    kind = "foreign-origin"
    status = 403
    title = "Web pages of this origin may not use the gateway"


@dataclass(frozen=True, slots=True)
class RequestOrigin:
    """Where a request goes and where it comes from, according to its headers."""

    method: str
    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    fetch_site: str = ""
    fetch_mode: str = ""
    server: str = ""
    """The address of this machine that received the connection."""


@lru_cache(256)
def host_and_port(text: str) -> tuple[str, int | None]:
    """Return name and port of a ``Host`` header; ``("", None)`` if it is not one.

    The name is in lower case, without a trailing dot, and an IPv6 address is in its short form without brackets.
    """
    found = _HOST.fullmatch(text.strip())
    if found is None or int(found["port"] or 0) > 65535:
        return "", None
    return _name(found["name"]), int(found["port"]) if found["port"] else None


def _name(text: str) -> str:
    name = text.strip("[]").lower().removesuffix(".")
    try:
        address = ip_address(name)
    except ValueError:
        return name
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return str(mapped or address)


@lru_cache(256)
def is_loopback(name: str) -> bool:
    """Return whether a name or address means this machine, whatever a name server says."""
    if name == "localhost" or name.endswith(".localhost"):
        return True
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return False


@lru_cache(256)
def origin_parts(text: str) -> tuple[str, str, int | None] | None:
    """Return scheme, name and port of an origin; None if it is not one, as ``null`` is not."""
    scheme, separator, rest = text.strip().partition("://")
    name, port = host_and_port(rest)
    if not separator or not name or not re.fullmatch(r"[a-zA-Z][a-zA-Z0-9+.-]*", scheme):
        return None
    return scheme.lower(), name, port or PORTS.get(scheme.lower())


def host_names(given: object) -> tuple[str, ...]:
    """Return the names of ``SHIFT_HOSTS``, comma separated. Raise ValueError if one is not a host name."""
    names = []
    for text in _listed(given):
        name, _ = host_and_port(text)
        if not name or name == "*":
            raise ValueError(f"{shorten(text)!r} is not a host name; write for example lab-pc.example.org")
        names.append(name)
    return tuple(names)


def origin_names(given: object) -> tuple[str, ...]:
    """Return the origins of ``SHIFT_ORIGINS``, comma separated. Raise ValueError if one is not an origin."""
    names = []
    for text in _listed(given):
        parts = origin_parts(text.removesuffix("/"))
        if parts is None or parts[0] not in ("http", "https"):
            rule = "write scheme, name and port, for example https://lab.example.org or http://localhost:3000"
            if text in ("*", "null"):
                rule = "it would let every web page in; " + rule
            raise ValueError(f"{shorten(text)!r} is not an origin; {rule}")
        names.append(_spelled(*parts))
    return tuple(names)


def _spelled(scheme: str, name: str, port: int | None) -> str:
    """Return the origin as browsers write it."""
    host = f"[{name}]" if ":" in name else name
    return f"{scheme}://{host}" + ("" if port in (None, PORTS.get(scheme)) else f":{port}")


def _listed(given: object) -> Iterable[str]:
    parts = given.split(",") if isinstance(given, str) else given
    assert isinstance(parts, (list, tuple))
    return [p.strip() for p in parts if p.strip()]


@dataclass(frozen=True)
class Rules:
    """The requests that this gateway answers: its own ``host``, further ``hosts``, and ``origins`` of other pages."""

    host: str
    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()

    def check(self, asked: RequestOrigin) -> str | None:
        """Return the named foreign origin that asks; None for a program or one of the gateway's own pages.

        Raises
        ------
        WrongHost
            The request is for another host.
        ForeignOrigin
            It comes from a web page that is neither one of the gateway's own nor named.
        """
        host = self._checked_host(asked)
        if asked.origins:
            return self._checked_origin(asked, host)
        navigates = asked.method in _READS and asked.fetch_mode == "navigate"
        if asked.fetch_site in ("cross-site", "same-site") and not navigates:
            said = "a web page of another origin asked, and its browser did not say which"
            raise ForeignOrigin(f"{said}; ask from a program, or with fetch() from an origin that SHIFT_ORIGINS names")
        return None

    def _checked_host(self, asked: RequestOrigin) -> str:
        """Return the host. HTTP/1.0 may leave it out; a browser always sends it."""
        if not asked.hosts:
            return ""
        if len(asked.hosts) > 1:
            raise WrongHost(f"the request names {len(asked.hosts)} hosts; it must have one Host header")
        name, _ = host_and_port(asked.hosts[0])
        if not (is_loopback(name) or (name and name in (_name(self.host), _name(asked.server), *self.hosts))):
            said = shorten(asked.hosts[0])
            remedy = f"if {said!r} is right, start it with SHIFT_HOSTS={shorten(name)}" if name else "write name:port"
            raise WrongHost(f"this gateway is not {said!r}; {remedy}. Its own names: {', '.join(self._own())}")
        return asked.hosts[0]

    def _own(self) -> tuple[str, ...]:
        listens = () if self.host in ("0.0.0.0", "::", "") or is_loopback(self.host) else (self.host,)
        return ("localhost", "127.0.0.1", "[::1]", *listens, *self.hosts)

    def _checked_origin(self, asked: RequestOrigin, host: str) -> str | None:
        origin = asked.origins[0]
        parts = origin_parts(origin)
        if len(asked.origins) == 1 and parts is not None:
            if parts[0] in ("http", "https") and parts[1:] == _with_port(host, parts[0]):
                return None
            if _spelled(*parts) in self.origins:
                return origin
        raise ForeignOrigin(_foreign(origin, parts))


@lru_cache(256)
def _with_port(host: str, scheme: str) -> tuple[str, int | None]:
    name, port = host_and_port(host)
    return name, port or PORTS[scheme]


def _foreign(origin: str, parts: tuple[str, str, int | None] | None) -> str:
    if parts is None:
        said = f"Origin {shorten(origin)!r} does not name a page (a page opened as a file has 'null')"
        remedy = "serve the page from a web server, for example with python -m http.server"
        return f"{said}; {remedy}, and start the gateway with its origin in SHIFT_ORIGINS"
    spelled = shorten(_spelled(*parts))
    return f"pages of {spelled} may not use this gateway; if they should, start it with SHIFT_ORIGINS={spelled}"
