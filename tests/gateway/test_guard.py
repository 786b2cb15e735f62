"""Browsers as clients: hosts, origins, CORS, HEAD, OPTIONS, and pages without another host."""

from __future__ import annotations

import json
import re
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from shift_gateway.app import make_app
from shift_gateway.settings import GatewaySettings
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import ManualClock
from support.gateway_mesh import Mesh, problem
from support.live_gateway import served
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

pytestmark = pytest.mark.anyio
LAB, EVIL = "https://lab.example.org", "http://evil.example"


@pytest.fixture
async def lab(tmp_path: Path, anyio_backend: str) -> AsyncIterator[httpx.AsyncClient]:
    """Yield a client of a gateway that pages of ``LAB`` may use, without any other service."""

    async def open_buses() -> list[Bus]:
        return [MemoryBus(Hub())]

    app = make_app(GatewaySettings(data=tmp_path, patience_s=0.1, origins=(LAB,)), open_buses, ManualClock(0))
    async with (
        app.router.lifespan_context(app),
        httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1:8080") as client,
    ):
        yield client


# --- hosts and origins ---


async def test_page_of_another_origin_changes_nothing(mesh: Mesh) -> None:
    session = await mesh.session()
    before = await session.read()
    plain = {"Origin": EVIL, "Content-Type": "text/plain"}
    found = problem(await mesh.ask("POST", session.path("markers"), {"text": "x"}, headers=plain), 403)
    assert EVIL in found["detail"]
    assert f"SHIFT_ORIGINS={EVIL}" in found["detail"]
    problem(await mesh.ask("POST", session.path("end"), headers=plain), 403)
    problem(await mesh.ask("GET", session.path("events"), headers=plain), 403)
    problem(await mesh.ask("POST", session.path("end"), headers={"Host": "evil.example"}), 421)
    assert await session.read() == before


@pytest.mark.parametrize("path", ["/docs", "/healthz", "/readyz", "/metrics", "/nowhere", "/v1/sessions"])
async def test_foreign_host_is_refused_on_every_path(mesh: Mesh, path: str) -> None:
    found = problem(await mesh.ask("GET", path, headers={"Host": "evil.example:80"}), 421)
    assert "SHIFT_HOSTS=evil.example" in found["detail"]


async def test_refusal_has_no_cors_headers(mesh: Mesh) -> None:
    preflight = {"Origin": EVIL, "Access-Control-Request-Method": "POST"}
    answer = await mesh.ask("OPTIONS", "/v1/sessions", headers=preflight)
    problem(answer, 403)
    assert not [name for name in answer.headers if name.startswith("access-control")]


async def test_websocket_of_a_foreign_page_is_refused(mesh: Mesh) -> None:
    session = await mesh.session()
    with served(mesh.app) as port:
        address = f"ws://127.0.0.1:{port}{session.path('gaze')}"
        for headers, status in (({"Origin": EVIL}, 403), ({"Origin": "null"}, 403)):
            with pytest.raises(InvalidStatus) as refused:
                connect(address, additional_headers=headers)
            assert refused.value.response.status_code == status
            assert json.loads(refused.value.response.body or b"")["status"] == status
        with connect(address, origin=f"http://127.0.0.1:{port}"):
            pass
        with connect(address):
            pass


# --- CORS ---


async def test_preflight_of_a_named_origin_is_answered(lab: httpx.AsyncClient) -> None:
    asks = {"Access-Control-Request-Method": "PATCH", "Access-Control-Request-Headers": "content-type, authorization"}
    answer = await lab.options("/v1/sessions/s1/config", headers={"Origin": LAB, **asks})
    assert answer.status_code == 200
    assert answer.headers["access-control-allow-origin"] == LAB
    assert {"GET", "POST", "PATCH"} <= set(answer.headers["access-control-allow-methods"].split(", "))
    assert {"Content-Type", "Authorization"} <= set(answer.headers["access-control-allow-headers"].split(", "))
    assert answer.headers["access-control-max-age"] == "600"
    assert "Origin" in answer.headers["vary"]
    assert "access-control-allow-credentials" not in answer.headers


async def test_answers_and_errors_carry_cors_headers_for_a_named_origin_only(lab: httpx.AsyncClient) -> None:
    for method, path, status in (
        ("GET", "/healthz", 200), ("GET", "/nowhere", 404), ("GET", "/v1/sessions/**", 422), ("POST", "/healthz", 405),
        ("POST", "/v1/sessions", 422),
    ):  # fmt: skip
        answer = await lab.request(method, path, headers={"Origin": LAB})
        assert (answer.status_code, answer.headers["access-control-allow-origin"]) == (status, LAB)
        assert "Origin" in answer.headers["vary"]
        plain = await lab.request(method, path)
        assert (plain.status_code, plain.headers["vary"]) == (status, "Origin")
        assert "access-control-allow-origin" not in plain.headers


# --- HEAD, OPTIONS, and what is not there ---

GETS = ("/docs", "/docs/start.js", "/docs/swagger-ui.css", "/openapi.json", "/favicon.ico", "/healthz", "/readyz",
        "/v1/sessions", "/v1/recordings")  # fmt: skip

PLAIN = {"Accept-Encoding": "identity"}


async def test_head_is_answered_as_get_without_a_body(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.end()
    with served(mesh.app) as port:
        async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", headers=PLAIN) as client:
            await heads_are_gets_without_a_body(client, f"/v1/recordings/{session.name}.mcap")


async def heads_are_gets_without_a_body(client: httpx.AsyncClient, recording: str) -> None:
    """Compare HEAD and GET through the real server, also for a part of a recording."""
    for path in (*GETS[:6], "/healthz", recording):
        found, whole = await client.head(path), await client.get(path)
        assert (found.status_code, found.content) == (200, b"")
        first, second = ([h for h in answer.headers.items() if h[0] != "date"] for answer in (found, whole))
        assert first == second, path
        assert int(found.headers["content-length"]) == len(whole.content), path
    assert (await client.head("/v1/recordings/none.mcap")).status_code == 404
    part, all_of_it = await client.get(recording, headers={"Range": "bytes=0-7"}), await client.get(recording)
    assert (part.status_code, part.content) == (206, all_of_it.content[:8])


async def test_head_of_reads_and_of_the_endless_stream_ends(mesh: Mesh) -> None:
    session = await mesh.session()
    for path in (*GETS, *(session.path(t) for t in ("", "observation", "policy", "config", "events"))):
        assert (await mesh.ask("HEAD", path)).status_code == 200, path


@pytest.mark.parametrize(
    ("path", "allowed"),
    [("/v1/sessions", "GET, HEAD, OPTIONS, POST"), ("/v1/sessions/s1/config", "GET, HEAD, OPTIONS, PATCH"),
     ("/v1/sessions/s1/decisions", "OPTIONS, POST"), ("/healthz", "GET, HEAD, OPTIONS")],
)  # fmt: skip
async def test_methods_of_a_path_are_named(mesh: Mesh, path: str, allowed: str) -> None:
    answer = await mesh.ask("OPTIONS", path)
    assert (answer.status_code, answer.headers["allow"], answer.content) == (204, allowed, b"")
    refused = await mesh.ask("PUT", path, {})
    assert refused.headers["allow"] == allowed
    assert f"PUT is not possible here; {allowed} are" in problem(refused, 405)["detail"]


@pytest.mark.parametrize(
    ("path", "says"),
    [("/v1/sessions/", "write /v1/sessions"), ("/V1/Sessions/S1", "write /v1/sessions/S1"), ("/nowhere", "at /docs"),
     ("/v1/sessions/s1/observation/", "write /v1/sessions/s1/observation"), ("/v1/sessions//decisions", "two slashes"),
     ("/redoc", "at /docs")],
)  # fmt: skip
@pytest.mark.parametrize("method", ["GET", "POST"])
async def test_unknown_path_is_not_redirected_and_gets_a_proposal(
    mesh: Mesh, method: str, path: str, says: str
) -> None:
    assert says in problem(await mesh.ask(method, path), 404)["detail"]


# --- pages and headers ---


async def test_pages_load_nothing_from_another_host(mesh: Mesh) -> None:
    for path in ("/docs", "/docs/start.js", "/favicon.ico"):
        text = (await mesh.ask("GET", path)).text.replace("http://www.w3.org/2000/svg", "")
        assert not re.findall(r"""(?:https?:)?//[a-z0-9.-]+\.[a-z]{2,}""", text), path
        for linked in re.findall(r"""(?:src|href)=["']([^"']+)""", text):
            assert (await mesh.ask("HEAD", linked)).status_code in (200, 503), linked
    assert not re.findall(r"url\(\s*[\"']?(?:https?:)?//", (await mesh.ask("GET", "/docs/swagger-ui.css")).text)


async def test_every_answer_has_the_security_headers(mesh: Mesh) -> None:
    for path in ("/docs", "/healthz", "/nowhere", "/v1/sessions/**", "/docs/swagger-ui-bundle.js"):
        headers = (await mesh.ask("GET", path)).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        policies = headers.get_list("content-security-policy")
        assert len(policies) == 1
        assert "default-src 'none'" in policies[0]
        assert "frame-ancestors 'none'" in policies[0]
        assert "unsafe-inline" not in policies[0].split("script-src")[-1].split(";")[0]
