"""A client of the gateway's REST paths, for the command line, the simulator and your own Python.

Every command carries an id, so a request without an answer is sent again safely. ::

    with RestClient("http://127.0.0.1:8080") as shift:
        shift.start("P01", session="s1")
        decision = shift.decide("s1", "grasp")
        shift.report("s1", decision["decision_id"], True, 5.0, True, 6.0)
        shift.end("s1")

Every error is a :class:`shift_schemas.errors.ShiftError` whose text is a sentence: ``MalformedMessage`` for a value
that breaks a rule (its ``errors`` name field, value and rule), ``UnknownThing``, ``Conflict``, ``Unavailable`` for a
gateway or service that does not answer, ``InvalidSettings`` for a text that is not a URL.
"""

from __future__ import annotations

import json
import secrets
from types import TracebackType
from typing import Any

import httpx
from shift_schemas.errors import (
    FieldError,
    InvalidSettings,
    MalformedMessage,
    Problem,
    ShiftError,
    Unavailable,
    check_id,
    shorten,
)
from shift_schemas.messages import AoiPositions, Command, Decide, EndSession, GazeChunk, ReportPerformance
from tenacity import Retrying, retry_if_exception_type, stop_after_delay, wait_exponential

from shift_runtime.endpoints import check_url

TIMEOUT_S = 60.0
"""The longest time of one request. It exceeds every sensible ``wait_s`` of a study."""
READY_TIMEOUT_S = 5.0
START = "start one with: shift-mesh up"


class RestClient:
    """Asks the gateway at ``url``.

    Parameters
    ----------
    patience_s
        How long a gateway or service may not answer before that is an error, seconds.
    timeout_s
        How long a single request may take, seconds.

    Raises
    ------
    InvalidSettings
        ``url`` is not the URL of a gateway.
    """

    def __init__(self, url: str, patience_s: float = 15.0, timeout_s: float = TIMEOUT_S) -> None:
        self.url = check_url(url)
        try:
            self._http = httpx.Client(base_url=self.url, timeout=timeout_s)
        except (httpx.InvalidURL, UnicodeError) as e:
            raise InvalidSettings(f"the gateway's URL is {shorten(url)!r}: {e}") from e
        self._retrying = Retrying(
            retry=retry_if_exception_type(Unavailable),
            stop=stop_after_delay(patience_s),
            wait=wait_exponential(multiplier=0.05, max=1.0),
            reraise=True,
        )

    def __enter__(self) -> RestClient:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._http.close()

    def command(self, kind: type[Command], session: str, **fields: Any) -> dict[str, Any]:
        """Carry out any command of a session that has a REST path, such as ``command(Mark, "s1", text="a note")``.

        ``fields`` are those of its body. A command id that is left out, or None, is made here, so that a request
        without an answer can be sent again.
        """
        if kind.route is None:
            raise MalformedMessage(f"{kind.procedure} has no path in the gateway; send it over Zenoh")
        check_id("session", session)
        if kind.id_field and fields.get(kind.id_field) is None:
            fields[kind.id_field] = f"{kind.id_prefix}{secrets.token_hex(8)}"
        body = fields if kind.route.media_types else None
        return self._ask(kind.route.method, kind.route.path.format(session=session), body)

    def start(self, participant: str, **given: Any) -> dict[str, Any]:
        """Begin a session; ``given`` is session, study, seed, condition."""
        body = {"participant": participant, "session": f"s-{secrets.token_hex(8)}"}
        return self._ask("POST", "/v1/sessions", body | {k: v for k, v in given.items() if v is not None})

    def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        """Send a chunk of gaze."""
        return self._ask("POST", _path(session, "/gaze"), chunk.model_dump(mode="json", exclude_none=True))

    def aois(self, session: str, positions: AoiPositions) -> dict[str, Any]:
        """Send AOIs that moved."""
        body = positions.model_dump(mode="json", exclude_none=True, exclude_unset=True)
        return self._ask("POST", _path(session, "/aois"), body)

    def decide(self, session: str, task: str, decision_id: str | None = None) -> dict[str, Any]:
        """Return the strategy to use now, and why."""
        return self.command(Decide, session, task=task, decision_id=decision_id)

    def report(
        self, session: str, decision_id: str, understood: bool, understood_s: float, able: bool, able_s: float,
        corrects: bool = False,
    ) -> dict[str, Any]:  # fmt: skip
        """Report how the task went, each dimension with success and seconds.

        ``corrects`` replaces an earlier report of the same decision.
        """
        fields: dict[str, Any] = {
            "decision_id": decision_id,
            "comprehension": {"success": understood, "duration_s": understood_s},
            "enabledness": {"success": able, "duration_s": able_s},
        } | ({"corrects": True} if corrects else {})
        return self.command(ReportPerformance, session, **fields)

    def end(self, session: str) -> dict[str, Any]:
        """End the session. It returns once the recording is finished."""
        return self.command(EndSession, session)

    def session(self, session: str) -> dict[str, Any]:
        """Return the session, with counts so far."""
        return self._ask("GET", _path(session))

    def observation(self, session: str) -> dict[str, Any]:
        """Return the partner model."""
        return self._ask("GET", _path(session, "/observation"))

    def config(self, session: str) -> dict[str, Any]:
        """Return the study in force, with its version."""
        return self._ask("GET", _path(session, "/config"))

    def ready(self) -> dict[str, Any]:
        """Return what ``/readyz`` says, ready or not. Raise :class:`Unavailable` where no gateway answers."""
        try:
            return self._object(self._http.get("/readyz", timeout=READY_TIMEOUT_S))
        except httpx.HTTPError as e:
            raise Unavailable(f"no gateway answers at {self.url}: {e or type(e).__name__}; {START}") from e
        except ShiftError as e:
            raise Unavailable(e.detail) from e

    def _ask(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        content = None if body is None else _json(body)
        for attempt in self._retrying:
            with attempt:
                return self._once(method, path, content)
        raise AssertionError("tenacity either returns or raises")

    def _once(self, method: str, path: str, content: bytes | None) -> dict[str, Any]:
        headers = {} if content is None else {"Content-Type": "application/json"}
        try:
            response = self._http.request(method, path, content=content, headers=headers)
        except httpx.ConnectTimeout as e:
            raise Unavailable(f"no gateway answers at {self.url}: the connection took too long; {START}") from e
        except httpx.TimeoutException as e:
            limit = self._http.timeout.read
            raise Unavailable(f"the gateway at {self.url} did not answer {method} {path} within {limit:g} s") from e
        except httpx.TransportError as e:
            raise Unavailable(f"no gateway answers at {self.url}: {e or type(e).__name__}; {START}") from e
        except httpx.RequestError as e:  # its body cannot be decoded
            raise self._not_a_gateway(f"{e or type(e).__name__}") from e
        if response.is_success:
            return self._object(response)
        raise self._error_of(response)

    def _object(self, response: httpx.Response) -> dict[str, Any]:
        try:
            answer = response.json()
        except ValueError as e:
            raise self._not_a_gateway(f"it answered with {_kind_of(response)}") from e
        if not isinstance(answer, dict):
            raise self._not_a_gateway("its answer is not a JSON object")
        return answer

    def _error_of(self, response: httpx.Response) -> ShiftError:
        """Return the error of a problem document, and of anything else a sentence that says what answered."""
        try:
            document = response.json()
            kind = str(document["type"]).rsplit(":", 1)[-1]
            errors = tuple(FieldError(**e) for e in document.get("errors", ()))
            return Problem(kind=kind, detail=document["detail"], errors=errors).error()
        except (ValueError, KeyError, TypeError, AttributeError):
            asked = f"{response.request.method} {response.request.url.path}"
            status = f"{response.status_code} {response.reason_phrase}".strip()
            return self._not_a_gateway(f"it answered {asked} with {status} and {_kind_of(response)}")

    def _not_a_gateway(self, why: str) -> ShiftError:
        return ShiftError(f"the server at {self.url} is not a SHIFT gateway: {why}. Is the URL the gateway's?")


def _path(session: str, tail: str = "") -> str:
    """Return the path of a session. Raises :class:`MalformedMessage` where ``session`` is not an id."""
    check_id("session", session)
    return f"/v1/sessions/{session}{tail}"


def _json(body: Any) -> bytes:
    try:
        return json.dumps(body, ensure_ascii=False, allow_nan=False).encode()
    except (TypeError, ValueError, RecursionError) as e:
        raise MalformedMessage(f"this cannot be sent as JSON: {e}; give plain numbers, text, lists and objects") from e


def _kind_of(response: httpx.Response) -> str:
    kind = response.headers.get("Content-Type", "").partition(";")[0]
    return shorten(kind) if response.content and kind else "something" if response.content else "an empty body"
