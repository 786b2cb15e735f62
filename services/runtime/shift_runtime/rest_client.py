"""A client of the gateway's REST paths, for the command line, the simulator and people's own Python.

Every command carries an id, so a request that got no answer is sent again safely. Errors arrive as the
error tree's. ::

    with RestClient("http://127.0.0.1:8080") as shift:
        shift.start("P01", session="s1")
        decision = shift.decide("s1", "grasp")
        shift.report("s1", decision["decision_id"], True, 5.0, True, 6.0)
        shift.end("s1")
"""

from __future__ import annotations

import secrets
from types import TracebackType
from typing import Any

import httpx
from shift_schemas.errors import FieldError, Problem, ShiftError, Unavailable
from shift_schemas.messages import GazeChunk
from tenacity import Retrying, retry_if_exception_type, stop_after_delay, wait_exponential

TIMEOUT_S = 60.0
"""A decision may wait for its study's ``wait_s``; longer than any that is sensible."""


class RestClient:
    """See the module. ``patience_s`` is how long a gateway or service may be away before it is an error."""

    def __init__(self, url: str, patience_s: float = 15.0) -> None:
        self.url = url.rstrip("/")
        self._http = httpx.Client(base_url=self.url, timeout=TIMEOUT_S)
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

    def start(self, participant: str, **given: Any) -> dict[str, Any]:
        """Begin a session; ``given`` is session, study, seed, condition."""
        body = {"participant": participant, "session": f"s-{secrets.token_hex(8)}"}
        return self._ask("POST", "/v1/sessions", body | {k: v for k, v in given.items() if v is not None})

    def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        """Stream a chunk in."""
        return self._ask("POST", f"/v1/sessions/{session}/gaze", chunk.model_dump(mode="json", exclude_none=True))

    def decide(self, session: str, task: str, decision_id: str | None = None) -> dict[str, Any]:
        """The strategy to use now."""
        body = {"task": task, "decision_id": decision_id or f"d-{secrets.token_hex(8)}"}
        return self._ask("POST", f"/v1/sessions/{session}/decisions", body)

    def report(
        self, session: str, decision_id: str, understood: bool, understood_s: float, able: bool, able_s: float,
        corrects: bool = False,
    ) -> dict[str, Any]:  # fmt: skip
        """How the task went, each dimension with success and seconds; ``corrects`` replaces an earlier report."""
        body = {
            "decision_id": decision_id,
            "comprehension": {"success": understood, "duration_s": understood_s},
            "enabledness": {"success": able, "duration_s": able_s},
        } | ({"corrects": True} if corrects else {})
        return self._ask("POST", f"/v1/sessions/{session}/performance", body)

    def end(self, session: str) -> dict[str, Any]:
        """End the session; its recording is finished then."""
        return self._ask("POST", f"/v1/sessions/{session}/end")

    def session(self, session: str) -> dict[str, Any]:
        """The session, with counts so far."""
        return self._ask("GET", f"/v1/sessions/{session}")

    def observation(self, session: str) -> dict[str, Any]:
        """The partner model."""
        return self._ask("GET", f"/v1/sessions/{session}/observation")

    def config(self, session: str) -> dict[str, Any]:
        """The study in force, with its version."""
        return self._ask("GET", f"/v1/sessions/{session}/config")

    def ready(self) -> dict[str, Any]:
        """What ``/readyz`` says, ready or not. Raises :class:`Unavailable` without a gateway."""
        try:
            return self._object(self._http.get("/readyz", timeout=5.0))
        except (httpx.HTTPError, ShiftError) as e:
            said = e.detail if isinstance(e, ShiftError) else e
            raise Unavailable(f"no gateway answers at {self.url}: {said}; start one with: shift-mesh up") from e

    def _ask(self, method: str, path: str, body: Any = None) -> dict[str, Any]:
        for attempt in self._retrying:
            with attempt:
                return self._once(method, path, body)
        raise AssertionError("tenacity either returns or raises")

    def _once(self, method: str, path: str, body: Any) -> dict[str, Any]:
        try:
            response = self._http.request(method, path, json=body)
        except httpx.TransportError as e:
            raise Unavailable(f"no gateway answers at {self.url}: {e or type(e).__name__}") from e
        if response.is_success:
            return self._object(response)
        raise _error_of(response)

    def _object(self, response: httpx.Response) -> dict[str, Any]:
        try:
            answer = response.json()
        except ValueError as e:
            raise ShiftError(f"what answers at {self.url} is no gateway: its answer is no JSON") from e
        if not isinstance(answer, dict):
            raise ShiftError(f"what answers at {self.url} is no gateway: its answer is no JSON object")
        return answer


def _error_of(response: httpx.Response) -> ShiftError:
    try:
        document = response.json()
        kind = str(document["type"]).rsplit(":", 1)[-1]
        errors = tuple(FieldError(**e) for e in document.get("errors", ()))
        return Problem(kind=kind, detail=document["detail"], errors=errors).error()
    except (ValueError, KeyError, TypeError):
        return ShiftError(f"the gateway answered {response.status_code} without saying why")
