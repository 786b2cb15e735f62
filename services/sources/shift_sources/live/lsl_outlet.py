"""Decisions, cognitive states and rewards as a marker stream of Lab Streaming Layer."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
from shift_schemas.errors import ShiftError, Unavailable
from tenacity import Retrying, retry_if_exception_type, wait_exponential

from shift_sources.live.lsl import load

SUBJECTS = ("decision", "estimate", "performance", "session")
ENDED = "ended"
LINGER_S = 2.0
"""How long the stream stays after its last marker, s: liblsl does not say when a marker has been sent."""


def marker_of(subject: str, fact: dict[str, Any]) -> dict[str, Any] | None:
    """Return what a fact's marker says, or None for a fact that has none. Pure."""
    match subject:
        case "decision":
            return {
                "event": "decision", "decision_id": fact["decision_id"], "n": fact["n"], "task": fact["task"],
                "strategy": fact["strategy"], "cognitive_state": fact["cognitive_state"],
                "policy_source": fact["policy_source"], "propensity": fact.get("propensity"),
            }  # fmt: skip
        case "estimate":
            return {"event": "state", "task": fact["task"], "cognitive_state": fact["cognitive_state"]}
        case "performance":
            return {
                "event": "reward", "decision_id": fact["decision_id"], "task": fact["task"], "reward": fact["reward"],
                "cumulative_reward": fact["cumulative_reward"],
            }  # fmt: skip
        case "session" if fact["state"] == ENDED:
            return {"event": "end", "session": fact["session"]}
    return None


def publish(url: str, session: str, name: str, tell: Callable[[str], None]) -> None:
    """Publish until the session ends or Ctrl-C.

    Raises
    ------
    ShiftError
        The session does not exist, or the gateway does not answer at the start.
    """
    pylsl = load()
    info = pylsl.StreamInfo(name, "Markers", 1, pylsl.IRREGULAR_RATE, "string", f"shift-{session}")
    outlet = pylsl.StreamOutlet(info)
    tell(f"stream {name!r}, type Markers: decisions, states and rewards of session {session}")
    try:
        for subject, fact in events(url, session):
            said = marker_of(subject, fact)
            if said is not None:
                outlet.push_sample([json.dumps(said, ensure_ascii=False)])
                if said["event"] == "end":
                    time.sleep(LINGER_S)
                    return
    except KeyboardInterrupt:
        pass


def events(url: str, session: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield subject and fact of each event of a session, and connect again where the connection is lost.

    What happens while nobody is connected does not come. Raises :class:`ShiftError` for a session that does not exist.
    """
    retrying = Retrying(retry=retry_if_exception_type(Unavailable), wait=wait_exponential(0.1, max=2.0))
    with httpx.Client(base_url=url, timeout=httpx.Timeout(10.0, read=None)) as http:
        while True:
            response = retrying(_connected, http, session)
            try:
                yield from _events_of(response)
            except httpx.TransportError:
                continue
            finally:
                response.close()


def _connected(http: httpx.Client, session: str) -> httpx.Response:
    try:
        response = http.send(http.build_request("GET", f"/v1/sessions/{session}/events"), stream=True)
    except httpx.TransportError as e:
        raise Unavailable(f"the gateway at {http.base_url} does not answer: {e}") from e
    if response.status_code == 200:
        return response
    response.read()
    problem = response.json() if "json" in response.headers.get("content-type", "") else {}
    response.close()
    detail = problem.get("detail", f"the gateway answered {response.status_code}")
    raise Unavailable(detail) if response.status_code >= 500 else ShiftError(detail)


def _events_of(response: httpx.Response) -> Iterator[tuple[str, dict[str, Any]]]:
    subject = ""
    for line in response.iter_lines():
        field, _, value = line.partition(":")
        if field == "event":
            subject = value.strip()
        elif field == "data" and subject in SUBJECTS:
            yield subject, json.loads(value)
