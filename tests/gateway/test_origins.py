"""The hosts and origins that the gateway answers, and its refusals of others."""

from __future__ import annotations

from typing import Any

import pytest
from shift_gateway.origins import ForeignOrigin, RequestOrigin, Rules, WrongHost
from shift_gateway.settings import GatewaySettings
from shift_runtime.settings import read_settings
from shift_schemas.errors import InvalidSettings

RULES = Rules("0.0.0.0", ("gateway", "lab-pc.example.org"), ("https://lab.example.org", "http://localhost:3000"))
HERE = "127.0.0.1:8080"


def asked(method: str = "POST", host: str = HERE, *origins: str, **given: Any) -> RequestOrigin:
    """Return the origin of a request."""
    return RequestOrigin(method, (host,), origins, **given)


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "127.0.0.1:8080", "127.0.0.1:9", "localhost", "LOCALHOST:8080", "localhost.:8080", "a.localhost",
     "127.8.0.1", "[::1]", "[::1]:8080", "[0:0:0:0:0:0:0:1]", "[::ffff:127.0.0.1]", "gateway:8080", "Gateway",
     "LAB-PC.example.org.:80", "192.168.1.5:8080"],
)  # fmt: skip
def test_loopback_named_hosts_and_the_address_that_was_reached_are_answered(host: str) -> None:
    assert RULES.check(asked("POST", host, server="192.168.1.5")) is None


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example", "notlocalhost", "lab-pc",
     "192.168.1.6", "10.0.0.1:8080", "[fe80::1]", "", ":8080", "127.0.0.1:99999", "127.0.0.1:x", "a@127.0.0.1",
     "127.0.0.1/x", "127.0.0.1, evil.example", "[::1", "::1", "*"],
)  # fmt: skip
def test_foreign_or_broken_host_is_refused_by_name(host: str) -> None:
    with pytest.raises(WrongHost) as refused:
        RULES.check(asked("GET", host, server="192.168.1.5"))
    assert repr(host) in refused.value.detail
    assert "localhost, 127.0.0.1, [::1], gateway, lab-pc.example.org" in refused.value.detail


def test_refusal_of_a_host_names_the_setting() -> None:
    with pytest.raises(WrongHost, match="start it with SHIFT_HOSTS=lab-pc"):
        RULES.check(asked("GET", "LAB-PC:8080"))


def test_two_hosts_are_refused_and_a_missing_host_is_accepted() -> None:
    with pytest.raises(WrongHost, match="names 2 hosts"):
        RULES.check(RequestOrigin("GET", (HERE, HERE)))
    assert RULES.check(RequestOrigin("GET")) is None, "HTTP/1.0 has none, and a browser always sends one"


@pytest.mark.parametrize(
    ("host", "origin"),
    [("127.0.0.1:8080", "http://127.0.0.1:8080"), ("LocalHost:8080", "http://localhost:8080"),
     ("gateway", "http://gateway"), ("gateway:80", "http://gateway"), ("gateway", "https://gateway"),
     ("[::1]:8080", "http://[::1]:8080")],
)  # fmt: skip
def test_gateway_s_own_page_needs_no_setting(host: str, origin: str) -> None:
    assert RULES.check(asked("POST", host, origin)) is None


@pytest.mark.parametrize("origin", ["https://lab.example.org", "http://localhost:3000"])
def test_named_origin_is_returned(origin: str) -> None:
    assert RULES.check(asked("POST", HERE, origin, fetch_site="cross-site")) == origin


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "http://127.0.0.1", "http://127.0.0.1:8081", "http://localhost:8080", "null", "", "*",
     "http://lab.example.org", "https://lab.example.org:8443", "https://lab.example.org.evil.example", "file://",
     "chrome-extension://abc", "127.0.0.1:8080", "ftp://127.0.0.1:8080"],
)  # fmt: skip
@pytest.mark.parametrize("method", ["GET", "POST", "OPTIONS", "PATCH"])
def test_foreign_origin_is_refused_by_name(method: str, origin: str) -> None:
    with pytest.raises(ForeignOrigin, match="SHIFT_ORIGINS") as refused:
        RULES.check(asked(method, HERE, origin))
    assert origin in refused.value.detail


def test_several_origins_are_refused() -> None:
    with pytest.raises(ForeignOrigin):
        RULES.check(asked("POST", HERE, f"http://{HERE}", "http://evil.example"))


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_without_an_origin_the_browser_s_fetch_site_decides(site: str) -> None:
    with pytest.raises(ForeignOrigin):
        RULES.check(asked("POST", HERE, fetch_site=site, fetch_mode="navigate"))
    with pytest.raises(ForeignOrigin):
        RULES.check(asked("GET", HERE, fetch_site=site, fetch_mode="no-cors"))
    assert RULES.check(asked("GET", HERE, fetch_site=site, fetch_mode="navigate")) is None, "a link on another page"
    for own in ("same-origin", "none", ""):
        assert RULES.check(asked("POST", HERE, fetch_site=own)) is None


# --- settings ---


def test_hosts_and_origins_are_read_from_comma_separated_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHIFT_HOSTS", " Gateway, lab-pc.example.org.:8080,")
    monkeypatch.setenv("SHIFT_ORIGINS", "HTTPS://Lab.Example.org/, http://localhost:3000,http://[::1]:80")
    settings = read_settings(GatewaySettings)
    assert isinstance(settings, GatewaySettings)
    assert settings.hosts == ("gateway", "lab-pc.example.org")
    assert settings.origins == ("https://lab.example.org", "http://localhost:3000", "http://[::1]")


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [("ORIGINS", "*", "every web page"), ("ORIGINS", "null", "every web page"),
     ("ORIGINS", "lab.example.org", "scheme"),
     ("ORIGINS", "https://lab.example.org/page", "scheme"), ("HOSTS", "http://gateway", "not a host name"),
     ("HOSTS", "*", "not a host name")],
)  # fmt: skip
def test_invalid_origin_or_host_prevents_the_start(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str, says: str
) -> None:
    monkeypatch.setenv(f"SHIFT_{name}", value)
    with pytest.raises(InvalidSettings, match=says) as refused:
        read_settings(GatewaySettings)
    assert f"SHIFT_{name}" in refused.value.detail
