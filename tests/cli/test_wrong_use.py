"""Wrong use of each command: one sentence and exit code 2, never a traceback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import typer
from shift_cli.entry import outcome
from shift_cli.main import app
from shift_schemas.errors import FieldError, MalformedMessage
from tenacity import stop_after_attempt

NOBODY = "http://127.0.0.1:9"


def wrong(capfd: pytest.CaptureFixture[str], *words: str) -> str:
    """Carry out a line that is wrong use; return what it says."""
    code = outcome(app, words)
    said = capfd.readouterr().err
    assert code == 2, said
    assert "Traceback" not in said
    assert "something went wrong inside" not in said
    return said


# --- files ---


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "binary").write_bytes(bytes(range(256)) * 8)
    (tmp_path / "latin.json").write_bytes('{"user": "müller"}'.encode("latin-1"))
    (tmp_path / "list.json").write_text("[]")
    (tmp_path / "deep.json").write_text("[" * 100_000)
    (tmp_path / "umlaut.json").write_text('{"user": "müller"}')
    return tmp_path


@pytest.mark.parametrize("command", [("simulate", "--url", NOBODY), ("evaluate", "learners", "--learner", "scoring")])
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("missing", "no file of that name"),
        ("folder", "cannot be read: Is a directory"),
        ("empty", "not a user file in JSON"),
        ("binary", "not text in UTF-8"),
        ("latin.json", "not text in UTF-8"),
        ("list.json", "should be an object"),
        ("deep.json", "not a user file in JSON"),
        ("umlaut.json", "user"),
        ("with\0null", "cannot be read"),
        ("x" * 5000, "cannot be read"),
        ("/proc/self/mem", "cannot be read: Input/output error"),  # what even root cannot read
    ],
    ids=lambda value: value[:12] if isinstance(value, str) else None,
)
def test_a_user_file_that_cannot_be_one(
    capfd: pytest.CaptureFixture[str], files: Path, command: tuple[str, ...], name: str, says: str
) -> None:
    assert says in wrong(capfd, *command, "--user", str(files / name))


@pytest.mark.parametrize("experiment", ["table2", "users", "learners"])
def test_an_output_folder_that_cannot_be_made_is_said_before_anything_is_computed(
    capfd: pytest.CaptureFixture[str], files: Path, experiment: str
) -> None:
    out = files / "empty" / "inside"
    said = wrong(capfd, "evaluate", experiment, "--runs", "1000000", "--out", str(out))
    assert f"--out is {out}" in said
    assert "give another" in said


def test_a_user_file_with_a_byte_order_mark_is_read(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from shift_simulator.user_files import find_user
    from shift_simulator.users import paper_user

    file = tmp_path / "me.json"
    text = paper_user("B").model_copy(update={"user": "me"}).model_dump_json(exclude={"capacity"})
    file.write_text(text, encoding="utf-8-sig")
    assert find_user(str(file)).user == "me"


# --- numbers ---


@pytest.mark.parametrize(
    "words",
    [
        ("evaluate", "table2", "--runs", "1"),
        ("evaluate", "table2", "--runs", "9" * 40),
        ("evaluate", "users", "--seed", "-1"),
        ("evaluate", "users", "--seed", "١٢x"),
        ("simulate", "--episodes", "0"),
        ("simulate", "--episodes", "9" * 40),
        ("simulate", "--seed", str(2**53)),
        ("up", "--port", "0"),
        ("up", "--port", "65536"),
        ("gaze", "play", "x", "--session", "s1", "--speed", "-1"),
    ],
    ids=" ".join,
)
def test_a_number_out_of_range_or_that_is_not_one(capfd: pytest.CaptureFixture[str], words: tuple[str, ...]) -> None:
    said = wrong(capfd, *words)
    assert words[-2] in said
    assert "Input should be" in " ".join(said.replace("│", " ").split())


# --- addresses ---


@pytest.mark.parametrize(
    "url", ["127.0.0.1:8080", "ftp://x", "http://", "http://[bad", "http://x:99999", "", "http://a b"]
)
def test_a_url_that_is_not_one(capfd: pytest.CaptureFixture[str], url: str) -> None:
    said = wrong(capfd, "simulate", "--url", url)
    assert f"the gateway's URL is {url!r}" in said
    assert "such as http://127.0.0.1:8080" in said


def test_no_gateway_there(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from shift_runtime import rest_client

    monkeypatch.setattr(rest_client, "stop_after_delay", lambda _: stop_after_attempt(1))
    said = wrong(capfd, "simulate", "--url", NOBODY)
    assert f"no gateway answers at {NOBODY}" in said
    assert "start one with: shift-mesh up" in said


@pytest.mark.parametrize(
    "endpoint", ["nonsense", "tcp/", "tcp/127.0.0.1", "tcp/127.0.0.1:x", "tcp/127.0.0.1:99999", "smoke/127.0.0.1:1", ""]
)
@pytest.mark.parametrize("flag", ["--zenoh", "--router"])
def test_an_endpoint_that_is_not_one(
    capfd: pytest.CaptureFixture[str], tmp_path: Path, flag: str, endpoint: str
) -> None:
    said = wrong(capfd, "up", "--data", str(tmp_path), flag, endpoint)
    assert f"{flag} is {endpoint!r}" in said
    assert "such as tcp/127.0.0.1:7447" in said


def test_a_host_that_is_not_known_is_named_with_its_flag(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    said = wrong(capfd, "up", "--host", "nowhere.invalid", "--data", str(tmp_path))
    assert "--host names the host 'nowhere.invalid', which is not known" in said


@pytest.mark.parametrize("data", ["empty", "empty/inside"])
def test_a_data_folder_that_cannot_be_one(capfd: pytest.CaptureFixture[str], files: Path, data: str) -> None:
    assert "give another folder with --data" in wrong(capfd, "up", "--data", str(files / data))


@pytest.mark.parametrize(
    ("variable", "value", "says"),
    [
        ("SHIFT_LOG_LEVEL", "loud", "SHIFT_LOG_LEVEL is 'loud': write one of debug, info, warning, error"),
        ("SHIFT_LOG_LEVEL", "debgu", "did you mean 'debug'?"),
        ("SHIFT_LOG_JSON", "perhaps", "SHIFT_LOG_JSON is 'perhaps'"),
        ("SHIFT_LISTEN", "nonsense", "SHIFT_LISTEN is 'nonsense': an endpoint is PROTOCOL/HOST:PORT"),
    ],
)
def test_a_variable_with_a_wrong_value_is_said_once_before_anything_starts(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
    variable: str, value: str, says: str,
) -> None:  # fmt: skip
    monkeypatch.setenv(variable, value)
    said = wrong(capfd, "up", "--data", str(tmp_path / "data"))
    assert says in said
    assert said.count(variable) == 1
    assert not (tmp_path / "data").exists()


def test_the_router_s_own_variable(capfd: pytest.CaptureFixture[str]) -> None:
    line = [sys.executable, "-m", "shift_cli.main", "router"]
    env = {**os.environ, "SHIFT_ROUTER_LISTEN": "nonsense"}
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, env=env, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("shift_router: SHIFT_ROUTER_LISTEN is 'nonsense': an endpoint is")


# --- what answers ---


@pytest.fixture
def stranger() -> Iterator[ThreadingHTTPServer]:
    """Run a web server that is not a gateway; it answers with ``server.answer``, or never if that is None."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            server.asked.set()
            if server.answer is None:
                server.over.wait(60)
                return
            status, kind, text = server.answer
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        do_GET = do_POST

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.asked, server.over, server.answer = threading.Event(), threading.Event(), None  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield server
    server.over.set()  # type: ignore[attr-defined]
    server.shutdown()
    server.server_close()
    thread.join()


def url_of(server: ThreadingHTTPServer) -> str:
    return f"http://127.0.0.1:{server.server_address[1]}"


@pytest.mark.parametrize(
    ("status", "kind", "text", "says"),
    [
        (404, "text/html", b"<html>Not Found</html>", "with 404 Not Found and text/html"),
        (500, "text/plain", b"oops", "with 500 Internal Server Error and text/plain"),
        (200, "text/html", b"<html>Welcome</html>", "it answered with text/html"),
        (200, "application/json", b"[1]", "its answer is not a JSON object"),
        (404, "application/json", b'{"detail": "Not Found"}', "with 404 Not Found and application/json"),
    ],
)
def test_another_server_is_not_taken_for_a_gateway(
    capfd: pytest.CaptureFixture[str], stranger: ThreadingHTTPServer, status: int, kind: str, text: bytes, says: str
) -> None:
    stranger.answer = (status, kind, text)  # type: ignore[attr-defined]
    said = wrong(capfd, "simulate", "--url", url_of(stranger))
    assert f"the server at {url_of(stranger)} is not a SHIFT gateway" in said
    assert says in said


def test_a_session_that_is_not_an_id_is_refused_by_its_field(
    capfd: pytest.CaptureFixture[str], stranger: ThreadingHTTPServer
) -> None:
    problem = {"type": "urn:shift:problem:malformed", "title": "", "status": 422, "detail": "session: not an id",
               "errors": [{"field": "session", "value": "P 01", "rule": "write P-01"},
                          {"field": "seed", "value": "x", "rule": "write a number"}]}  # fmt: skip
    stranger.answer = (422, "application/problem+json", json.dumps(problem).encode())  # type: ignore[attr-defined]
    said = wrong(capfd, "simulate", "--session", "P 01", "--url", url_of(stranger))
    assert said.endswith("shift-mesh: session: not an id\n  seed: write a number\n")


def test_ctrl_c_ends_a_command_without_a_traceback(stranger: ThreadingHTTPServer) -> None:
    line = [sys.executable, "-m", "shift_cli.main", "simulate", "--url", url_of(stranger)]
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a shell's background jobs do not hear it
    process = subprocess.Popen(line, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
    assert stranger.asked.wait(60)  # type: ignore[attr-defined]
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said


# --- the entry point itself ---


def failing(error: BaseException) -> typer.Typer:
    broken = typer.Typer()

    @broken.command()
    def fail() -> None:
        raise error

    return broken


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (OSError(28, "No space left on device", "/data/x"), 2, "shift-mesh: /data/x: No space left on device\n"),
        (
            MalformedMessage("this is wrong", (FieldError(field="this", value="", rule="b"),)),
            2,
            "shift-mesh: this is wrong\n",
        ),
        (typer.Exit(1), 1, ""),
        (KeyboardInterrupt(), 130, ""),
        (ZeroDivisionError("division by zero"), 2, "This is a mistake in shift-mesh: please report it"),
    ],
    ids=repr,
)
def test_each_error_has_its_exit_code_and_no_traceback(
    capfd: pytest.CaptureFixture[str], error: BaseException, code: int, says: str
) -> None:
    assert outcome(failing(error), []) == code
    said = capfd.readouterr().err
    assert says in said
    assert "Traceback" not in said


def test_a_mistake_of_ours_shows_where_it_is_for_who_asks(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHIFT_DEBUG", "1")
    outcome(failing(ZeroDivisionError()), [])
    assert "Traceback" in capfd.readouterr().err
