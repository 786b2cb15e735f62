"""The REST client, with a small HTTP server whose answers the tests set."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import (
    Conflict,
    FieldError,
    InvalidSettings,
    MalformedMessage,
    ShiftError,
    Unavailable,
    UnknownThing,
)
from shift_schemas.messages import Command, Configure, GazeChunk, Mark


@dataclass
class Gateway:
    """Answers with the entries of ``answers`` in turn, and then always with the last one."""

    answers: list[tuple[int, Any]] = field(default_factory=lambda: [(200, {})])
    asked: list[tuple[str, str, Any]] = field(default_factory=list)
    port: int = 0

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def answer(self) -> tuple[int, Any]:
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


@pytest.fixture
def gateway() -> Iterator[Gateway]:
    known = Gateway()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            known.asked.append((self.command, self.path, json.loads(body) if body else None))
            status, content = known.answer()
            if status == -1:  # the gateway hangs
                time.sleep(1.0)
                return
            if status == 0:  # the gateway dies in the middle of the request
                self.connection.close()
                return
            text = content if isinstance(content, bytes) else json.dumps(content).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        do_GET = do_PATCH = do_POST

        def log_message(self, format: str, *args: Any) -> None:
            pass

        def finish(self) -> None:
            try:
                super().finish()
            except (OSError, ValueError):
                return

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    known.port = server.server_address[1]
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield known
    server.shutdown()
    server.server_close()
    thread.join()


def problem(kind: str, detail: str, status: int, errors: Any = ()) -> tuple[int, Any]:
    return status, {"type": f"urn:shift:{kind}", "title": "", "status": status, "detail": detail, "errors": errors}


@pytest.fixture
def shift(gateway: Gateway) -> Iterator[RestClient]:
    with RestClient(gateway.url + "/", patience_s=1.0) as client:
        yield client


def test_each_method_requests_its_path(gateway: Gateway, shift: RestClient) -> None:
    shift.start("P1", session="s1", study="coffee", seed=7, condition=None)
    shift.gaze("s1", GazeChunk(source="eyes", seq=0, t=[0.0], x=[0.5], y=[None]))
    shift.decide("s1", "grasp", "d1")
    shift.report("s1", "d1", True, 5.0, False, 6.0)
    shift.end("s1")
    shift.session("s1")
    shift.observation("s1")
    shift.config("s1")
    assert shift.ready() == {}
    comprehension, enabledness = {"success": True, "duration_s": 5.0}, {"success": False, "duration_s": 6.0}
    assert gateway.asked == [
        ("POST", "/v1/sessions", {"participant": "P1", "session": "s1", "study": "coffee", "seed": 7}),
        ("POST", "/v1/sessions/s1/gaze", {"source": "eyes", "seq": 0, "t": [0.0], "x": [0.5], "y": [None]}),
        ("POST", "/v1/sessions/s1/decisions", {"task": "grasp", "decision_id": "d1"}),
        (
            "POST",
            "/v1/sessions/s1/performance",
            {"decision_id": "d1", "comprehension": comprehension, "enabledness": enabledness},
        ),
        ("POST", "/v1/sessions/s1/end", None),
        ("GET", "/v1/sessions/s1", None),
        ("GET", "/v1/sessions/s1/observation", None),
        ("GET", "/v1/sessions/s1/config", None),
        ("GET", "/readyz", None),
    ]


def test_any_command_with_a_path_can_be_sent(gateway: Gateway, shift: RestClient) -> None:
    shift.command(Mark, "s1", text="a note", marker_id="m1")
    shift.command(Configure, "s1", capacity={"start": 0.5})
    assert gateway.asked == [
        ("POST", "/v1/sessions/s1/markers", {"text": "a note", "marker_id": "m1"}),
        ("PATCH", "/v1/sessions/s1/config", {"capacity": {"start": 0.5}}),
    ]
    gateway.asked.clear()
    shift.command(Mark, "s1", text="a note")
    assert gateway.asked[0][2]["marker_id"].startswith("m-")


def test_command_without_a_path_is_refused(gateway: Gateway, shift: RestClient) -> None:
    class Hidden(Command):
        owner = "decider"
        procedure = "hidden"

    with pytest.raises(MalformedMessage, match="hidden has no path in the gateway"):
        shift.command(Hidden, "s1")
    assert gateway.asked == []


def test_command_without_an_id_gets_one_that_is_the_same_in_every_attempt(gateway: Gateway, shift: RestClient) -> None:
    gateway.answers = [problem("unavailable", "the decider does not answer", 503), (0, None), (201, {"n": 1})]
    assert shift.decide("s1", "grasp") == {"n": 1}
    ids = {body["decision_id"] for _, _, body in gateway.asked}
    assert len(gateway.asked) == 3
    assert len(ids) == 1
    gateway.asked.clear()
    gateway.answers = [(0, None), (201, {})]
    shift.start("P1")
    assert len({body["session"] for _, _, body in gateway.asked}) == 1


@pytest.mark.parametrize(
    ("kind", "status", "error"),
    [("conflict", 409, Conflict), ("unknown", 404, UnknownThing), ("malformed", 422, MalformedMessage)],
)
def test_problem_arrives_as_the_same_error_and_is_not_retried(
    gateway: Gateway, shift: RestClient, kind: str, status: int, error: type[ShiftError]
) -> None:
    errors = [{"field": "task", "value": "x", "rule": "one of them"}]
    gateway.answers = [problem(kind, "what is wrong", status, errors)]
    with pytest.raises(error, match="what is wrong") as found:
        shift.decide("s1", "x")
    assert found.value.errors == (FieldError(field="task", value="x", rule="one of them"),)
    assert len(gateway.asked) == 1


def test_every_field_of_a_problem_is_in_the_error(gateway: Gateway, shift: RestClient) -> None:
    errors = [{"field": f"{part}.duration_s", "value": "-1", "rule": "at least 0"} for part in ("one", "other")]
    gateway.answers = [problem("malformed", "one.duration_s: at least 0", 422, errors)]
    with pytest.raises(MalformedMessage, match=r"one\.duration_s: at least 0") as found:
        shift.report("s1", "d1", True, -1, True, -1)
    assert [e.field for e in found.value.errors] == ["one.duration_s", "other.duration_s"]


def test_timeout_names_its_limit(gateway: Gateway) -> None:
    gateway.answers = [(-1, None)]
    limit = r"did not answer GET /v1/sessions/s1 within 0\.2 s"
    with RestClient(gateway.url, patience_s=0.0, timeout_s=0.2) as shift, pytest.raises(Unavailable, match=limit):
        shift.session("s1")


@pytest.mark.parametrize("session", ["P 01", "a/b", "..", "", "ü", "x" * 64, "s1?x"])
def test_session_that_is_not_an_id_is_refused_before_a_request(
    gateway: Gateway, shift: RestClient, session: str
) -> None:
    asking = (
        lambda: shift.session(session),
        lambda: shift.decide(session, "grasp"),
        lambda: shift.report(session, "d1", True, 1.0, True, 1.0),
        lambda: shift.end(session),
        lambda: shift.config(session),
        lambda: shift.observation(session),
        lambda: shift.gaze(session, GazeChunk(source="eyes", seq=0, t=[0.0], aoi=["cup"])),
    )
    for ask in asking:
        with pytest.raises(MalformedMessage, match="is not an id: 1 to 63 letters") as found:
            ask()
        assert found.value.errors[0].field == "session"
    assert gateway.asked == []
    with pytest.raises(MalformedMessage, match="for example P-01"):
        shift.end("P 01")


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), object()], ids=["nan", "inf", "object"])
def test_value_that_is_not_json_is_refused_before_a_request(gateway: Gateway, shift: RestClient, seconds: Any) -> None:
    with pytest.raises(MalformedMessage, match="cannot be sent as JSON"):
        shift.report("s1", "d1", True, seconds, True, 5.0)
    with pytest.raises(MalformedMessage, match="cannot be sent as JSON"):
        shift.start("P1", study={"study": "\ud800"})
    assert gateway.asked == []


@pytest.mark.parametrize("url", ["127.0.0.1:8080", "", "http://", "ftp://x", "http://a\x00b"])
def test_invalid_url_is_refused_at_once(url: str) -> None:
    with pytest.raises(InvalidSettings, match="the gateway's URL is"):
        RestClient(url)


def test_service_that_stays_unavailable_is_named_at_the_end(gateway: Gateway) -> None:
    gateway.answers = [problem("unavailable", "the monitor does not answer", 503)]
    with RestClient(gateway.url, patience_s=0.2) as shift, pytest.raises(Unavailable, match="the monitor does not"):
        shift.observation("s1")
    assert len(gateway.asked) > 1


def test_missing_gateway_is_named(gateway: Gateway) -> None:
    with RestClient("http://127.0.0.1:1", patience_s=0.1) as shift:
        with pytest.raises(Unavailable, match=r"no gateway answers at http://127\.0\.0\.1:1"):
            shift.session("s1")
        with pytest.raises(Unavailable, match="start one with: shift-mesh up"):
            shift.ready()


@pytest.mark.parametrize("content", [b"<html>Bad gateway</html>", b"", [], {"detail": "no type"}, "text"])
def test_error_without_a_problem_document_is_still_an_error(gateway: Gateway, shift: RestClient, content: Any) -> None:
    gateway.answers = [(500, content)]
    with pytest.raises(ShiftError, match="is not a SHIFT gateway: it answered GET /v1/sessions/s1 with 500"):
        shift.session("s1")


@pytest.mark.parametrize("content", [b"<html>welcome</html>", b"", b"[1]", b'"text"'])
def test_another_server_on_the_port_is_not_a_gateway(gateway: Gateway, shift: RestClient, content: bytes) -> None:
    gateway.answers = [(200, content)]
    with pytest.raises(ShiftError, match="is not a SHIFT gateway"):
        shift.session("s1")
    with pytest.raises(Unavailable, match="is not a SHIFT gateway"):
        shift.ready()


def test_readiness_is_returned_even_if_the_mesh_is_not_ready(gateway: Gateway, shift: RestClient) -> None:
    gateway.answers = [(503, {"ready": False, "missing": ["monitor"], "services": {}})]
    assert shift.ready()["missing"] == ["monitor"]
