"""Repeated commands over REST: a repeat gets the first result, another content is refused."""

from __future__ import annotations

from typing import Any

import pytest
from support.gateway_mesh import Mesh

pytestmark = pytest.mark.anyio


async def test_repeated_start_after_the_end_returns_the_ended_session(mesh: Mesh) -> None:
    body = {"participant": "P01", "session": "over", "seed": 7}
    first = (await mesh.ask("POST", "/v1/sessions", body)).json()
    end = (await mesh.ask("POST", "/v1/sessions/over/end")).json()
    again = await mesh.ask("POST", "/v1/sessions", body)
    assert again.status_code == 200
    known = (await mesh.ask("GET", "/v1/sessions/over")).json()
    changed = {name: known[name] for name in ("state", "ended", "recording", "sha256", "counts")}
    assert changed["state"] == "ended"
    assert changed["ended"]
    assert (changed["recording"], changed["sha256"]) == ("over.mcap", end["sha256"])
    assert again.json() == first | changed


async def test_repeated_start_during_the_end_returns_the_ending_session(own_mesh: Mesh) -> None:
    body = {"participant": "P01", "session": "slow"}
    assert (await own_mesh.ask("POST", "/v1/sessions", body)).json()["state"] == "live"
    await own_mesh.stop("learner")  # the end waits for it and gives up, and stays begun
    assert (await own_mesh.ask("POST", "/v1/sessions/slow/end")).status_code == 503
    again = await own_mesh.ask("POST", "/v1/sessions", body)
    assert (again.status_code, again.json()["state"]) == (200, "ending")


async def test_refusal_of_a_used_session_names_both_participants_even_after_the_end(mesh: Mesh) -> None:
    body = {"participant": "P01", "session": "used"}
    await mesh.ask("POST", "/v1/sessions", body)
    for _ in range(2):
        answer = await mesh.ask("POST", "/v1/sessions", body | {"participant": "P02"})
        assert answer.status_code == 409
        assert answer.json()["detail"] == (
            "session used is there already, with participant P01; this start says participant P02. "
            "Choose another session id."
        )
        await mesh.ask("POST", "/v1/sessions/used/end")


RIGHT = {"success": True, "duration_s": 5.0}
PLAIN = {"negation": "affirmation", "hesitation": "none"}


@pytest.mark.parametrize(
    ("path", "first", "change", "says"),
    [
        ("decisions", {"task": "grasp", "decision_id": "d1"}, {"task": "turn"}, ("decision d1", "grasp", "turn")),
        (
            "overrides",
            {"task": "grasp", "strategy": PLAIN, "override_id": "o1"},
            {"strategy": PLAIN | {"hesitation": "hesitation"}},
            ("override o1", "hesitation none", "hesitation hesitation"),
        ),
        ("markers", {"text": "one", "marker_id": "m1"}, {"text": "two"}, ("marker m1", "text one", "text two")),
        (
            "performance",
            {"decision_id": "d0", "comprehension": RIGHT, "enabledness": RIGHT},
            {"enabledness": {"success": False, "duration_s": 5.0}},
            ("decision d0", "enabledness.success true", "enabledness.success false"),
        ),
    ],
    ids=["decide", "override", "mark", "report"],
)
async def test_id_with_another_content_is_a_conflict_that_names_both(
    mesh: Mesh, path: str, first: dict[str, Any], change: dict[str, Any], says: tuple[str, ...]
) -> None:
    session = await mesh.session()
    await session.done("decisions", {"task": "grasp", "decision_id": "d0"})
    path = session.path("override" if path == "overrides" else path)
    assert (await mesh.ask("POST", path, first)).status_code == 201
    assert (await mesh.ask("POST", path, first)).status_code in (200, 201)
    answer = await mesh.ask("POST", path, first | change)
    assert answer.status_code == 409
    for words in says:
        assert words in answer.json()["detail"]
    assert answer.json()["errors"], "the fields are named as well"
