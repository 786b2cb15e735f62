"""Each kind of body that clients send: accepted, or refused with its own sentence."""

from __future__ import annotations

import gzip
import json

import pytest
from support.gateway_mesh import Mesh, gaze_socket, problem

pytestmark = pytest.mark.anyio
START = '{"participant": "P01"}'
FORM = b'--x\r\nContent-Disposition: form-data; name="task"\r\n\r\ngrasp\r\n--x--\r\n'


@pytest.mark.parametrize(
    "kind", ["application/x-www-form-urlencoded", "text/plain", "application/json; charset=utf-8", "", "nonsense", None]
)
async def test_json_is_accepted_with_any_content_type(mesh: Mesh, kind: str | None) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    assert (await mesh.ask("POST", "/v1/sessions", content=START, headers=headers)).status_code == 201


@pytest.mark.parametrize("mark", ["\ufeff", " \n", ""])
async def test_byte_order_mark_and_white_space_are_accepted(mesh: Mesh, mark: str) -> None:
    assert (await mesh.ask("POST", "/v1/sessions", content=(mark + START + "\r\n").encode())).status_code == 201
    session = await mesh.session()
    async with gaze_socket(mesh, session.name) as socket:
        assert (await socket.send(mark + '{"source":"a","seq":0,"t":[0.0],"aoi":["left"]}'))["accepted"] == 1


@pytest.mark.parametrize(
    ("body", "says"),
    [(b"", "it is empty; send an object"), (b" \n", "it is empty"), (gzip.compress(START.encode(), mtime=0), "gzip"),
     (START.encode("utf-16"), "UTF-16"), (START.encode("utf-16-le"), "UTF-16"), (START.encode("utf-16-be"), "UTF-16"),
     (START.encode("utf-32"), "UTF-32"), ('{"title": "Küche"}'.encode("latin-1"), "not in UTF-8 (byte 12 is 0xfc)"),
     (b"participant=P01&session=w", 'send a JSON object: {"participant": "P01", "session": "w"}'),
     (b"task=grasp+cup", "it is a form (task=grasp cup)"), (FORM, "multipart"),
     (b"%7B%22participant%22%3A%22P01%22%7D", "percent-encoded"), (b"%7b%22a%22%3a1%7d=", "percent-encoded"),
     (b"{'participant': 'P01'}", "single quotes"), (b"[{'a': 1}]", "single quotes"),
     (b"{participant: P01}", "no quotes"),
     ("{“participant”: “P01”}".encode(), "typographic"), (b'{"a":1}\n{"a":2}', "more after its first value"),
     (b'{"a":1,}', "line 1, column"), (b'{"a":\n True}', "line 2, column 2"), (b"[" * 50_000, "nesting")],
    ids=lambda v: ascii(v)[:30],
)  # fmt: skip
async def test_body_that_is_not_json_is_refused_with_its_own_sentence(mesh: Mesh, body: bytes, says: str) -> None:
    found = problem(await mesh.ask("POST", "/v1/sessions", content=body), 422)
    assert found["detail"].startswith("body: the body must be JSON: ")
    assert says in found["detail"]
    assert found["errors"] == [{"field": "body", "value": "", "rule": found["detail"].removeprefix("body: ")}]


@pytest.mark.parametrize(
    ("body", "says"),
    [([{"participant": "P01"}], "a list; send one object"), (json.dumps({"a": 1}), "encoded twice"),
     ("hello", "a JSON string"), (7, "it is 7"), (True, "it is true")],
    ids=repr,
)  # fmt: skip
async def test_body_that_is_not_an_object_is_refused_with_its_own_sentence(mesh: Mesh, body: object, says: str) -> None:
    assert says in problem(await mesh.ask("POST", "/v1/sessions", content=json.dumps(body)), 422)["detail"]


@pytest.mark.parametrize("encoding", ["gzip", "deflate", "br", "gzip, identity"])
async def test_compressed_body_is_refused(mesh: Mesh, encoding: str) -> None:
    session = await mesh.session()
    for path in ("/v1/sessions", session.path("gaze")):
        headers = {"Content-Encoding": encoding}
        answer = await mesh.ask("POST", path, content=gzip.compress(START.encode()), headers=headers)
        assert f"Content-Encoding: {encoding}" in problem(answer, 415)["detail"]


async def test_values_in_the_address_are_shown_as_a_body(mesh: Mesh) -> None:
    session = await mesh.session()
    found = problem(await mesh.ask("POST", session.path("decisions?task=grasp")), 422)
    assert 'into the body instead: {"task": "grasp"}' in found["detail"]


async def test_get_with_a_body_explains_that_it_is_not_read(mesh: Mesh) -> None:
    session = await mesh.session()
    found = problem(await mesh.ask("GET", session.path("strategy"), {"task": "grasp"}), 422)
    assert "task: it is missing; write it into the address" in found["detail"]
    assert "given 2 times" in problem(await session.get("strategy?task=a&task=b"), 422)["detail"]


async def test_invalid_id_gets_the_same_proposal_everywhere(mesh: Mesh) -> None:
    session = await mesh.session()
    for answer in (
        await session.post("decisions", {"task": "Tasse füllen"}),
        await session.get("strategy?task=Tasse%20f%C3%BCllen"),
        await mesh.ask("GET", "/v1/sessions/Tasse%20f%C3%BCllen"),
    ):
        assert problem(answer, 422)["errors"][0]["rule"].endswith("; for example Tasse-fuellen")
