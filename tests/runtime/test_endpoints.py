"""Addresses that a person writes: endpoints and URLs are parsed, or refused with the rule and an example."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_runtime.endpoints import EXAMPLE, PROTOCOLS, check_url, parse_endpoint
from shift_schemas.errors import InvalidSettings


@given(st.sampled_from(PROTOCOLS), st.from_regex(r"[a-z][a-z0-9-]{0,20}", fullmatch=True), st.integers(0, 65535))
def test_endpoint_gives_host_and_port(protocol: str, host: str, port: int) -> None:
    assert parse_endpoint(f"{protocol}/{host}:{port}") == (host, port)


def test_address_in_brackets_and_parameters_are_understood() -> None:
    assert parse_endpoint("tcp/[::1]:7447?a=b#c") == ("::1", 7447)


@pytest.mark.parametrize("text", ["", "tcp", "tcp/", "tcp/host", "tcp/:1", "tcp/host:", "tcp/host:65536", "http/h:1"])
def test_invalid_endpoint_is_refused_with_its_flag_and_an_example(text: str) -> None:
    with pytest.raises(InvalidSettings, match="--zenoh is") as refused:
        parse_endpoint(text, "--zenoh")
    assert EXAMPLE in refused.value.detail
    assert repr(text) in refused.value.detail


@pytest.mark.parametrize(("text", "url"), [("http://a:8080/", "http://a:8080"), ("https://lab.org", "https://lab.org")])
def test_url_loses_its_last_slash(text: str, url: str) -> None:
    assert check_url(text) == url


@pytest.mark.parametrize("text", ["", "a:8080", "http://", "ftp://a", "http://a:0", "http://a:70000", "http://a b"])
def test_invalid_url_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(InvalidSettings, match=r"such as http://127\.0\.0\.1:8080"):
        check_url(text)
