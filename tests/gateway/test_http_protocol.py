"""Requests that offer HTTP/2, as Java and ``curl --http2`` send them: their bodies are read, and WebSockets open."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterator

import pytest
from fastapi import FastAPI, Request, WebSocket
from support.live_gateway import answers, served
from websockets.sync.client import connect

OFFER = b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAEAAEAAAAIAAAAA\r\n"
LAST = b"GET /last HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
"""A request after which the server closes the connection, so that a test knows that nothing follows."""


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Yield the port of a server that returns what it read."""
    app = FastAPI()

    @app.api_route("/{path}", methods=["GET", "POST"])
    async def said_back(request: Request, path: str) -> dict[str, object]:
        return {"path": path, "body": (await request.body()).decode(), "headers": sorted(request.headers.keys())}

    @app.websocket("/socket")
    async def socket(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text(await socket.receive_text())

    with served(app) as found:
        yield found


def answers_in(raw: bytes) -> list[tuple[str, str]]:
    """Return path and body of each answer."""
    lines = [line for line in raw.decode().replace("}HTTP", "}\r\nHTTP").splitlines() if line.startswith("{")]
    return [(answer["path"], answer["body"]) for answer in map(json.loads, lines)]


def post(path: bytes, body: bytes, more: bytes = OFFER) -> bytes:
    """Return a request with a length."""
    head = b"POST /" + path + b" HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + str(len(body)).encode()
    return head + b"\r\n" + more + b"\r\n" + body


CHUNKED = (
    b"POST /c HTTP/1.1\r\nHost: l\r\nTransfer-Encoding: chunked\r\n" + OFFER + b"\r\n3\r\nabc\r\n2\r\nde\r\n0\r\n\r\n"
)


@pytest.mark.parametrize("size", [1, 7, 64, 1000, 100_000])
def test_offer_of_http2_is_ignored_and_the_body_is_read(port: int, size: int) -> None:
    large = b"x" * 5000 if size > 7 else b"xy"
    whole = post(b"a", b'{"task": "grasp"}') + CHUNKED + post(b"b", large) + post(b"e", b"") + LAST
    pieces = [whole[i : i + size] for i in range(0, len(whole), size)]
    assert answers_in(answers(port, pieces)) == [
        ("a", '{"task": "grasp"}'), ("c", "abcde"), ("b", large.decode()), ("e", ""), ("last", ""),
    ]  # fmt: skip


def test_body_may_come_long_after_the_headers(port: int) -> None:
    request = post(b"a", b"late")
    raw = answers(port, [request[:-4], request[-4:-2], request[-2:], LAST])
    assert answers_in(raw) == [("a", "late"), ("last", "")]


def test_server_that_ignores_the_offer_still_answers_expect(port: int) -> None:
    request = post(b"a", b"asked", OFFER + b"Expect: 100-continue\r\n")
    raw = answers(port, [request[:-5], request[-5:], LAST])
    assert raw.startswith(b"HTTP/1.1 100 Continue\r\n")
    assert answers_in(raw) == [("a", "asked"), ("last", "")]


def test_other_offers_and_further_headers_are_ignored_as_well(port: int) -> None:
    offer = b"Upgrade: TLS/1.0\r\nConnection: keep-alive, upgrade\r\nX-Mine: 1\r\n"
    raw = answers(port, [post(b"a", b"q", offer), LAST])
    assert answers_in(raw) == [("a", "q"), ("last", "")]
    assert b"x-mine" in raw
    assert b'"upgrade"' not in raw


def test_nonsense_after_an_offer_is_a_bad_request(port: int) -> None:
    raw = answers(port, [b"POST /c HTTP/1.1\r\nHost: l\r\nTransfer-Encoding: chunked\r\n" + OFFER + b"\r\nzz\r\n"])
    assert raw.startswith(b"HTTP/1.1 400")


def test_websocket_still_opens(port: int) -> None:
    with connect(f"ws://127.0.0.1:{port}/socket") as socket:
        socket.send("hello")
        assert socket.recv() == "hello"


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_curl_with_http2_posts(port: int) -> None:
    command = ["curl", "-sS", "--http2", f"http://127.0.0.1:{port}/a", "-d", '{"task": "grasp"}']
    found = subprocess.run(command, capture_output=True, check=True, timeout=30)
    assert json.loads(found.stdout)["body"] == '{"task": "grasp"}'
