"""Steering over REST: the learner paused, overrides withdrawn, markers retracted, and who made each change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from shift_recording.mcap.reader import facts
from shift_verify.verify import verify
from support.gateway_mesh import NEGATED, PLAIN, STUDY, Mesh, Session, problem

pytestmark = pytest.mark.anyio
LEARNERS = ("scoring", "q-learning", "epsilon-greedy", "ucb1", "thompson", "linear-thompson", "planner")


async def values(session: Session) -> Any:
    """Return values and visits of the policy."""
    policy = await session.read("policy")
    return {name: (row["values"], row["visits"]) for name, row in policy["states"].items()}


async def recording_of(session: Session) -> Path:
    """End the session; return its recording, verified."""
    ended = await session.end()
    path = session.mesh.data / "recordings" / ended["recording"]
    report = verify(path)
    assert report.ok, report
    return path


@pytest.mark.parametrize("learner", LEARNERS)
async def test_paused_learner_records_reports_and_learns_nothing(mesh: Mesh, learner: str) -> None:
    session = await mesh.session({**STUDY, "learner": {"name": learner}})
    await session.report((await session.decide())["decision_id"])
    assert (await session.configure({"learner": {"paused": True}})).status_code == 200
    decision = await session.decide()
    before = await values(session)
    answer = await session.report(decision["decision_id"], understood=False)
    assert answer["cumulative_reward"] == (await session.read("policy"))["cumulative_reward"]
    assert await values(session) == before
    assert (await session.configure({"learner": {"paused": False}})).status_code == 200
    await session.report((await session.decide())["decision_id"])
    found = [f.fact for f in facts(await recording_of(session))]
    learned = {f.decision_id for f in found if f.subject == "transition"}
    reported = [f.decision_id for f in found if f.subject == "performance"]
    assert learned == {reported[0], reported[2]}


async def test_report_from_before_the_pause_is_still_learned_with_the_next_decision(mesh: Mesh) -> None:
    session = await mesh.session({**STUDY, "learner": {"discount": 0.9}})
    first = await session.decide()
    await session.report(first["decision_id"])
    await session.configure({"learner": {"paused": True}})
    await session.decide()
    found = [f.fact for f in facts(await recording_of(session)) if f.fact.subject == "transition"]
    assert [f.decision_id for f in found] == [first["decision_id"]]


async def test_override_is_withdrawn_before_a_decision_used_it(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.done("override", {"task": "grasp", "strategy": NEGATED, "override_id": "o1"})
    withdrawn = await session.done("override", {"task": "grasp", "withdraws": "o1", "author": "Anna"})
    assert (withdrawn["withdraws"], withdrawn["strategy"], withdrawn["author"]) == ("o1", {}, "Anna")
    assert (await session.read("strategy?task=grasp"))["policy_source"] != "override"
    assert (await session.decide())["policy_source"] == "learner"
    await recording_of(session)


@pytest.mark.parametrize("then", ["used", "replaced", "withdrawn", "never"])
async def test_override_that_does_not_wait_cannot_be_withdrawn(mesh: Mesh, then: str) -> None:
    session = await mesh.session(STUDY)
    if then != "never":
        await session.done("override", {"task": "grasp", "strategy": NEGATED, "override_id": "o1"})
    if then == "used":
        await session.decide()
    elif then == "replaced":
        await session.done("override", {"task": "grasp", "strategy": PLAIN})
    elif then == "withdrawn":
        await session.done("override", {"task": "grasp", "withdraws": "o1"})
    detail = problem(await session.post("override", {"task": "grasp", "withdraws": "o1"}), 409)["detail"]
    assert detail.startswith("override o1 does not wait for a decision of task grasp")


@pytest.mark.parametrize("body", [{"task": "grasp"}, {"task": "grasp", "withdraws": "o1", "strategy": NEGATED}])
async def test_override_needs_either_a_strategy_or_a_withdrawal(mesh: Mesh, body: dict[str, Any]) -> None:
    session = await mesh.session(STUDY)
    await session.done("override", {"task": "grasp", "strategy": NEGATED, "override_id": "o1"})
    problem(await session.post("override", body), 422)


async def test_marker_is_retracted_by_a_second_one(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.done("markers", {"text": "wrong button", "marker_id": "m1"})
    retraction = {"text": "it was the right one", "retracts": "m1", "marker_id": "m2", "author": "Anna"}
    assert (await session.done("markers", retraction))["retracts"] == "m1"
    assert (await session.post("markers", retraction)).status_code == 200, "a repeat"
    problem(await session.post("markers", {"text": "again", "retracts": "m1"}), 409)
    problem(await session.post("markers", {"text": "again", "retracts": "m9"}), 404)
    found = [f.fact for f in facts(await recording_of(session)) if f.fact.subject == "marker"]
    assert [(m.marker_id, m.retracts, m.author) for m in found] == [("m1", "", ""), ("m2", "m1", "Anna")]


async def test_configuration_and_result_name_their_author(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    patch = {"reward": {"scale": 2}}
    assert (await mesh.ask("PATCH", session.path("config?author=Anna"), patch)).status_code == 200
    decision = await session.decide()
    result = {"success": True, "duration_s": 5.0}
    report = {"decision_id": decision["decision_id"], "comprehension": result, "enabledness": result, "author": "Ben"}
    assert (await session.done("performance", report))["author"] == "Ben"
    problem(await mesh.ask("PATCH", session.path(f"config?author={'x' * 101}"), patch), 422)
    problem(await mesh.ask("PATCH", session.path("config?author=a&author=b"), patch), 422)
    found = [f.fact for f in facts(await recording_of(session)) if f.fact.subject == "config"]
    assert [c.author for c in found] == ["", "Anna"]


async def test_openapi_describes_the_author_of_a_change(mesh: Mesh) -> None:
    document = (await mesh.ask("GET", "/openapi.json")).json()
    parameters = document["paths"]["/v1/sessions/{session}/config"]["patch"]["parameters"]
    assert "author" in [p["name"] for p in parameters if p["in"] == "query"]
