"""Gaze, decisions, performance, overrides and reads over REST, field by field."""

from __future__ import annotations

import asyncio
import json
from math import exp
from typing import Any

import pytest
from shift_model.random_numbers import pick, uniform
from shift_model.vocabulary import TRIPLES, Triple
from support.gateway_mesh import NEGATED, PLAIN, STUDY, Mesh, Session, gaze_socket, performance

pytestmark = pytest.mark.anyio
ACTIONS = [
    {"negation": n, "hesitation": h}
    for n in ("affirmation", "negation_affirmation", "negation")
    for h in ("none", "hesitation")
]


# --- decisions ---


async def test_first_decision_has_every_field(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.look(["left"] * 4)
    answer = await session.post("decisions", {"task": "grasp", "decision_id": "d1"})
    assert answer.status_code == 201
    found = answer.json()
    action = pick([0.375, *[0.125] * 5], uniform(7, 1))
    assert found.items() >= {
        "decision_id": "d1", "session": session.name, "task": "grasp", "n": 1, "strategy": ACTIONS[action],
        "stamp": {"sec": 1_700_000_000, "nsec": 0},
        "observation": {"capacity": "high", "gaze": "focused", "awareness": "unknown"},
        "scores": {"negation": 1 / 3, "hesitation": 1 / 3}, "cognitive_state": "engaged_observer",
        "suggested": PLAIN, "actions": ACTIONS, "probabilities": [0.375, *[0.125] * 5],
        "propensity": [0.375, *[0.125] * 5][action], "explored": action != 0, "policy_source": "learner",
        "stale": False,
    }.items()  # fmt: skip
    assert found["versions"].keys() == {"observation", "policy", "config"}
    assert list(found["strategy"]) == ["negation", "hesitation"]


async def test_two_sessions_of_one_seed_decide_alike_and_another_seed_does_not(mesh: Mesh) -> None:
    async def ten(seed: int) -> list[Any]:
        session = await mesh.session(seed=seed)
        return [(await session.decide(decision_id=f"d{n}"))["strategy"] for n in range(10)]

    alike, other = await asyncio.gather(ten(7), ten(7)), await ten(8)
    assert alike[0] == alike[1] != other


async def test_repeat_gets_the_first_result_and_another_content_is_a_conflict(mesh: Mesh) -> None:
    session = await mesh.session()
    first = await session.post("decisions", {"task": "grasp", "decision_id": "d1"})
    again = await session.post("decisions", {"task": "grasp", "decision_id": "d1"})
    other = await session.post("decisions", {"task": "turn", "decision_id": "d1"})
    assert (first.status_code, again.status_code, other.status_code) == (201, 200, 409)
    assert first.json() == again.json()
    assert (await session.decide())["n"] == 2, "the repeats count for nothing"


async def test_simultaneous_repeats_are_one_decision(mesh: Mesh) -> None:
    session = await mesh.session()
    answers = await asyncio.gather(
        *(session.post("decisions", {"task": "grasp", "decision_id": "d1"}) for _ in range(8))
    )
    assert len({json.dumps(a.json()) for a in answers}) == 1
    assert (await session.read())["counts"]["decision"] == 1


async def test_simultaneous_decisions_are_numbered_without_a_gap(mesh: Mesh) -> None:
    session = await mesh.session()
    answers = await asyncio.gather(*(session.decide(decision_id=f"d{i}") for i in range(12)))
    assert sorted(a["n"] for a in answers) == list(range(1, 13))
    assert not any(a["stale"] for a in answers)
    assert {a["policy_source"] for a in answers} == {"learner"}


async def test_task_that_the_study_does_not_have_is_unknown(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    for answer in (
        await session.post("decisions", {"task": "pour"}),
        await session.post("override", {"task": "pour", "strategy": PLAIN}),
        await session.get("strategy?task=pour"),
    ):
        assert answer.status_code == 404
        assert "has no task 'pour'; it has grasp, turn" in answer.json()["detail"]


# --- the preview ---


async def test_preview_is_the_decision_that_follows_and_has_no_side_effect(mesh: Mesh) -> None:
    session = await mesh.session()
    for n in range(1, 6):
        previews = [await session.read("strategy?task=grasp")]
        before = (await session.read())["counts"]
        previews += [await session.read("strategy?task=grasp") for _ in range(2)]
        assert previews[0] == previews[1] == previews[2]
        assert "decision_id" not in previews[0]
        after = (await session.read())["counts"]
        assert all(after[name] == before[name] for name in before if name != "estimate"), (
            "estimates may be on their way"
        )
        decision = await session.decide(decision_id=f"d{n}")
        assert {k: v for k, v in decision.items() if k != "decision_id"} == previews[0]
        await session.report(f"d{n}", understood=n % 2 == 0)


async def test_decision_and_preview_have_the_text_of_the_study(mesh: Mesh) -> None:
    phrases = {"sentences": {"affirmation": "take {task}.", "negation": "do not take {task}."}}
    session = await mesh.session({**STUDY, "phrases": phrases})
    silent = {"negation": "negation_affirmation", "hesitation": "none"}
    for strategy, text in ((PLAIN, "Take grasp."), (NEGATED, "Do not take grasp."), (silent, None)):
        await session.done("override", {"task": "grasp", "strategy": strategy})
        assert (await session.read("strategy?task=grasp"))["text"] == text
        assert (await session.decide())["text"] == text


async def test_preview_shows_an_override_that_waits(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.done("override", {"task": "grasp", "strategy": NEGATED})
    shown = await session.read("strategy?task=grasp")
    assert (shown["strategy"], shown["propensity"], shown["policy_source"]) == (NEGATED, None, "override")
    assert (await session.read("strategy?task=turn"))["policy_source"] == "learner"


# --- performance ---


async def test_report_answers_with_the_reward(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.decide(decision_id="d1")
    answer = await session.post("performance", performance("d1", understood=True, able=False, seconds=3.0))
    assert answer.status_code == 201
    assert answer.json().items() >= {
        "decision_id": "d1", "session": session.name, "task": "grasp", "reward": 0.0, "comprehension": exp(-0.3),
        "enabledness": -exp(-0.3), "cumulative_reward": 0.0,
    }.items()  # fmt: skip
    await session.decide(decision_id="d2")
    assert (await session.report("d2", seconds=0.0))["cumulative_reward"] == 1.0
    assert (await session.read("policy"))["cumulative_reward"] == 1.0


async def test_report_counts_once(mesh: Mesh) -> None:
    session = await mesh.session()
    await session.decide(decision_id="d1")
    first = await session.post("performance", performance("d1"))
    again = await session.post("performance", performance("d1"))
    other = await session.post("performance", performance("d1", understood=False))
    assert (first.status_code, again.status_code, other.status_code) == (201, 200, 409)
    assert first.json() == again.json()
    counts = (await session.read())["counts"]
    assert counts["performance"] == counts["transition"] == 1


async def test_report_of_an_unknown_decision_is_unknown(mesh: Mesh) -> None:
    session = await mesh.session()
    answer = await session.post("performance", performance("nobody"))
    assert answer.status_code == 404
    assert "no decision nobody" in answer.json()["detail"]


# --- override and markers ---


async def test_override_holds_for_the_task_s_next_decision(mesh: Mesh) -> None:
    session = await mesh.session()
    body = {"task": "grasp", "strategy": NEGATED, "reason": "the other hand", "override_id": "o1"}
    answer = await session.post("override", body)
    assert answer.status_code == 201
    assert answer.json().items() >= {**body, "session": session.name}.items()
    assert (await session.post("override", body)).status_code == 200
    assert (await session.post("override", body | {"strategy": PLAIN})).status_code == 409
    other = await session.decide("turn")
    assert other["policy_source"] == "learner"
    mine = await session.decide("grasp")
    assert (mine["strategy"], mine["propensity"], mine["policy_source"]) == (NEGATED, None, "override")
    assert (await session.decide("grasp"))["policy_source"] == "learner"


@pytest.mark.parametrize(
    "strategy", [{}, {"negation": "negation"}, NEGATED | {"pace": "slow"}, NEGATED | {"negation": "no"}], ids=str
)
async def test_override_that_is_not_a_strategy_is_refused_by_field(mesh: Mesh, strategy: dict[str, str]) -> None:
    session = await mesh.session()
    answer = await session.post("override", {"task": "grasp", "strategy": strategy})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"].startswith("strategy.")


async def test_repeated_marker_is_recorded_once(mesh: Mesh) -> None:
    session = await mesh.session()
    body = {"text": "the participant laughs ☺\n", "marker_id": "m1"}
    first, again = await session.post("markers", body), await session.post("markers", body)
    assert (first.status_code, again.status_code) == (201, 200)
    assert first.json() == again.json()
    assert first.json().items() >= body.items()
    assert (await session.post("markers", body | {"text": "other"})).status_code == 409
    assert (await session.read())["counts"]["marker"] == 1


# --- gaze and the observation ---


async def test_observation_has_every_field(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    fresh = await session.read("observation")
    assert fresh["session"] == session.name
    assert fresh["capacity"] == {"value": 1.0, "category": "high"}
    assert fresh["gaze"] == {
        "category": "uncertain", "weights": {"robot": 0.5, "cup": 0.5}, "focus_shift": 0.0, "aoi": None, "fixations": 0,
        "dropped": 0, "restarts": 0, "samples": 0, "dwell_s": 0.0, "lost": 0.0, "unclassified": 0.0, "off_aoi": 0.0,
        "off_stimulus": 0.0, "valid": None, "received": None, "age_s": None,
    }  # fmt: skip
    assert fresh["warnings"] == []
    assert fresh["awareness"] == {}
    assert await session.look(["robot"] * 7, 0.1) == {"accepted": 7}
    mesh.clock.ns += 2_500_000_000
    decision = await session.decide()
    await session.report(decision["decision_id"], understood=True, able=False)
    seen = await session.read("observation")
    assert seen["gaze"]["weights"] == pytest.approx({"robot": 1.0, "cup": 0.0})
    assert (seen["gaze"]["category"], seen["gaze"]["aoi"]) == ("focused", "robot")
    assert (seen["gaze"]["samples"], seen["gaze"]["dwell_s"], seen["gaze"]["lost"]) == (7, pytest.approx(0.6), 0.0)
    assert seen["gaze"]["age_s"] == 2.5, "of the last sample, when asked"
    assert seen["awareness"] == {
        "grasp": {"category": "misconception_enabledness", "comprehension": 1.0, "enabledness": 0.0, "results": 1}
    }
    assert seen["seen"].items() >= {"gaze": {"ros": 0}, "decision": 1, "performance": 1, "config": 1}.items()
    assert seen["version"] > fresh["version"]


async def test_points_become_fixations_on_aois(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    t = [i / 100 for i in range(60)]
    x: list[float | None] = [0.25] * 30 + [0.75] * 30
    x[10] = None
    chunk = {"source": "tx300", "seq": 0, "t": t, "x": x, "y": [None if v is None else 0.5 for v in x]}
    answer = await session.post("gaze", chunk)
    assert (answer.status_code, answer.json()) == (202, {"accepted": 60})
    found = await session.read("observation")
    assert (found["gaze"]["fixations"], found["gaze"]["aoi"]) == (1, "cup")
    await session.end()
    assert (await session.read())["counts"]["fixation"] == 2, "what is open when the session ends, ends there"


async def test_chunk_numbers_are_checked(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)

    async def send(seq: int, t: float) -> Any:
        return await session.done("gaze", {"source": "a", "seq": seq, "t": [t], "aoi": ["cup"]})

    assert await send(0, 0.0) == {"accepted": 1}
    assert await send(0, 0.0) == {"accepted": 1}, "a repeat is acknowledged and ignored"
    assert await send(3, 3.0) == {"accepted": 1}
    assert (await session.read("observation"))["gaze"]["dropped"] == 2
    assert await send(1, 1.0) == {
        "accepted": 0, "warnings": ["chunk 1 comes after chunk 3: it is recorded and not applied"]
    }  # fmt: skip
    assert (await session.read())["counts"]["gaze"] == 3


async def test_restarted_tracker_loses_no_acknowledged_chunk(mesh: Mesh) -> None:
    """Send 200 chunks over REST and WebSocket, then again from number 0 with other content, and each of them twice."""
    session = await mesh.session(STUDY)

    def chunk(seq: int, start_s: float, x: float) -> dict[str, Any]:
        t = [round(start_s + seq * 0.05 + i / 100, 6) for i in range(5)]
        return {"source": "tx300", "seq": seq, "t": t, "x": [x] * 5, "y": [0.5] * 5}

    sent = [chunk(seq, 100.0, 0.1) for seq in range(60)] + [chunk(seq, 110.0, 0.9) for seq in range(60)]
    for body in sent[:90]:
        first = await session.done("gaze", body)
        assert first == await session.done("gaze", body), "the same content gets the first result"
    async with gaze_socket(mesh, session.name) as socket:
        for body in sent[90:]:
            assert (await socket.send(body))["accepted"] == 5
            assert (await socket.send(body))["accepted"] == 5
    gaze = (await session.read("observation"))["gaze"]
    assert (gaze["restarts"], gaze["aoi"], gaze["dropped"], gaze["samples"]) == (1, "cup", 0, 600)
    assert (await session.read())["counts"]["gaze"] == 120
    await session.done("gaze", sent[0])
    assert (await session.read())["counts"]["gaze"] == 120, "a repeat is one, however long ago"


async def test_same_gaze_sent_twice_at_once_is_recorded_once(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    body = {"source": "a", "seq": 0, "t": [0.0, 0.1], "aoi": ["cup", "cup"]}
    answers = await asyncio.gather(*(session.done("gaze", body) for _ in range(8)))
    assert answers == [{"accepted": 2}] * 8
    assert (await session.read())["counts"]["gaze"] == 1


async def test_accepted_gaze_without_an_effect_gets_a_warning(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    t = [i / 2 for i in range(10)]
    answer = await session.done("gaze", {"source": "a", "seq": 0, "t": t, "x": [0.1] * 10, "y": [0.5] * 10})
    assert answer["accepted"] == 10
    assert any("can never make a fixation" in warning for warning in answer["warnings"])
    assert (await session.read("observation"))["warnings"] == answer["warnings"]


async def test_aoi_that_the_study_does_not_name_is_refused_with_those_that_it_has(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    answer = await session.post("gaze", {"source": "a", "seq": 0, "t": [0.0, 1.0], "aoi": ["robot", "moon"]})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["field"], error["value"]) == ("aoi.1", "moon")
    assert "robot, cup" in error["rule"]


async def test_source_that_was_replaced_is_refused(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.look(["cup"], source="first")
    await session.look(["cup"], source="second")
    answer = await session.post("gaze", {"source": "first", "seq": 1, "t": [9.0], "aoi": ["cup"]})
    assert answer.status_code == 409
    assert "first was replaced by second" in answer.json()["detail"]


async def test_time_must_rise_over_chunks(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.look(["cup", "cup"])
    answer = await session.post("gaze", {"source": "ros", "seq": 1, "t": [0.5], "aoi": ["cup"]})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "t"


async def test_websocket_accepts_one_chunk_in_each_message(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    async with gaze_socket(mesh, session.name) as socket:
        chunk = {"source": "ws", "seq": 0, "t": [0.0, 0.5], "aoi": ["cup", None]}
        assert await socket.send(chunk) == {"accepted": 2, "seq": 0}
        assert await socket.send(json.dumps(chunk | {"seq": 1, "t": [1.0, 1.5]}).encode()) == {"accepted": 2, "seq": 1}
        for nonsense, status in (
            ("{", 422), ("", 422), (b"\xff", 422), ("[]", 422), ('{"seq":1,"seq":1}', 422),
            (chunk | {"aoi": ["moon", None]}, 422),
            ("x" * (256 * 1024 + 1), 413), (chunk | {"seq": 2, "t": [1.5, 9.0]}, 422),
        ):  # fmt: skip
            problem = await socket.send(nonsense)
            assert problem["status"] == status
            assert problem.keys() == {"type", "title", "status", "detail", "errors"}
            assert len(problem["detail"]) < 500
        assert await socket.send(chunk | {"seq": 2, "t": [2.0, 2.5]}) == {"accepted": 2, "seq": 2}, "it lives on"
    assert (await session.read("observation"))["seen"]["gaze"] == {"ws": 2}


@pytest.mark.parametrize(("name", "status"), [("nobody", 404), ("**", 422)])
async def test_websocket_answers_with_problems_of_ids_and_sessions(mesh: Mesh, name: str, status: int) -> None:
    async with gaze_socket(mesh, name) as socket:
        assert (await socket.send("{"))["status"] == status


# --- corrections ---


async def test_wrong_report_is_corrected_and_both_are_kept(mesh: Mesh) -> None:
    session = await mesh.session()
    decision_id = (await session.decide())["decision_id"]
    result = {"success": False, "duration_s": 5000.0}
    wrong = {"decision_id": decision_id, "comprehension": result, "enabledness": result}
    first = await session.done("performance", wrong)
    assert any("divide milliseconds by 1000" in warning for warning in first["warnings"])
    right = {name: {"success": True, "duration_s": 5.0} for name in ("comprehension", "enabledness")}
    body = {"decision_id": decision_id, **right, "corrects": True}
    corrected, again = await session.post("performance", body), await session.post("performance", body)
    assert (corrected.status_code, again.status_code) == (201, 200)
    assert corrected.json() == again.json()
    assert corrected.json()["cumulative_reward"] == pytest.approx(exp(-0.5))
    seen = await session.read("observation")
    assert seen["awareness"]["grasp"] == {
        "category": "success", "comprehension": 1.0, "enabledness": 1.0, "results": 1
    }  # fmt: skip
    assert (await session.read("policy"))["cumulative_reward"] == corrected.json()["cumulative_reward"]
    assert (await session.read())["counts"]["performance"] == 2
    assert (await session.post("performance", {**body, "decision_id": "nothing"})).status_code == 404


async def test_correction_without_a_report_is_refused(mesh: Mesh) -> None:
    session = await mesh.session()
    decision_id = (await session.decide())["decision_id"]
    right = {name: {"success": True, "duration_s": 5.0} for name in ("comprehension", "enabledness")}
    answer = await session.post("performance", {"decision_id": decision_id, **right, "corrects": True})
    assert answer.status_code == 409
    assert "send it without corrects" in answer.json()["detail"]


# --- the policy ---


async def test_policy_has_every_field(mesh: Mesh) -> None:
    session = await mesh.session()
    policy = await session.read("policy")
    assert (policy["version"], policy["learner"], policy["for_n"]) == (1, "q-learning", 1)
    assert (policy["actions"], policy["epsilon"], policy["cumulative_reward"]) == (ACTIONS, 0.75, 0.0)
    assert list(policy["states"]) == [
        "engaged_observer", "overwhelmed_struggler", "engaged_misinterpreter", "unfocused", "distracted_misinterpreter",
        "uncertain",
    ]  # fmt: skip
    assert policy["states"]["engaged_observer"] == {
        "probabilities": [0.375, *[0.125] * 5], "values": [1.0, 0, 0, 0, 0, 0], "visits": [0] * 6,
    }  # fmt: skip
    decision = await session.decide()
    assert (await session.read("policy"))["for_n"] == 2
    await session.report(decision["decision_id"], seconds=0.0)
    row = (await session.read("policy"))["states"][decision["cognitive_state"]]
    assert row["visits"][decision["actions"].index(decision["strategy"])] == 1


async def test_learner_without_exploration_has_no_epsilon(mesh: Mesh) -> None:
    session = await mesh.session(STUDY, condition="control")
    assert (await session.read("policy"))["epsilon"] is None


async def test_learner_on_triples_names_its_states_by_triples(mesh: Mesh) -> None:
    session = await mesh.session({"study": "x", "learner": {"name": "ucb1"}})
    policy = await session.read("policy")
    assert list(policy["states"]) == [t.name for t in TRIPLES]
    await session.look(["left"] * 4)
    assert (await session.decide())["state"] == "high/focused/unknown"


# --- later answers include everything that was answered before ---


async def test_next_read_and_decision_include_every_write(mesh: Mesh) -> None:
    session = await mesh.session({"study": "x"})
    for n in range(1, 9):
        await session.look(["left", "right"])
        decision = await session.decide(decision_id=f"d{n}")
        assert decision["seen"]["gaze"] == {"ros": n - 1}
        assert (decision["seen"]["performance"], decision["seen"]["config"]) == (n - 1, n)
        await session.report(f"d{n}")
        observation, policy = await session.read("observation"), await session.read("policy")
        assert observation["awareness"]["grasp"]["results"] == n
        assert (observation["seen"]["decision"], policy["seen"]["decision"]) == (n, n)
        assert (policy["seen"]["performance"], policy["for_n"]) == (n, n + 1)
        changed = await session.configure({"reward": {"scale": n}})
        assert changed.json()["version"] == (await session.read("config"))["version"] == n + 1
        shown = await session.read("strategy?task=grasp")
        assert (shown["versions"]["config"], shown["n"], shown["stale"]) == (n + 1, n + 1, False)


async def test_simultaneous_sessions_are_independent(mesh: Mesh) -> None:
    one, two = await mesh.session(seed=1), await mesh.session(seed=2)

    async def live(session: Session, rounds: int) -> None:
        for n in range(rounds):
            await session.look(["left"] if session is one else ["right"])
            decision = await session.decide(decision_id=f"d{n}")
            await session.report(decision["decision_id"], understood=session is one)

    await asyncio.gather(live(one, 8), live(two, 5))
    for session, rounds, category in ((one, 8, "success"), (two, 5, "misconception_comprehension")):
        shown = await session.read("observation")
        assert shown["awareness"]["grasp"] == shown["awareness"]["grasp"] | {"results": rounds, "category": category}
        assert (await session.read())["counts"]["decision"] == rounds
    ends = await asyncio.gather(one.end(), two.end())
    assert [e["counts"]["performance"] for e in ends] == [8, 5]


# --- all 30 triples ---

EO, EM, DM, OS, UF = (
    "engaged_observer", "engaged_misinterpreter", "distracted_misinterpreter", "overwhelmed_struggler", "unfocused",
)  # fmt: skip
MODEL = {
    ("low", "distracted"): (OS, OS, UF, OS, UF),
    ("low", "focused"): (OS, OS, EO, OS, EO),
    ("high", "distracted"): (UF, UF, DM, UF, DM),
    ("high", "focused"): (EO, EO, EM, EO, EM),
}
"""docs/model.md; uncertain counts as distracted."""
RESULTS = {
    "failure": (False, False), "misconception_enabledness": (True, False), "misconception_comprehension": (False, True),
    "success": (True, True),
}  # fmt: skip


async def reach_state(session: Session, triple: Triple) -> None:
    """Bring a session into a monitoring state by strategies, looks and results."""
    if triple.gaze == "focused":
        await session.look(["left"] * 6)
    elif triple.gaze == "distracted":
        await session.look(["left", "right"] * 6, step_s=0.1)
    changing = [NEGATED, NEGATED | {"negation": "negation_affirmation"}] * 2
    for strategy in changing[:4] if triple.capacity == "low" else [PLAIN]:
        await session.done("override", {"task": "grasp", "strategy": strategy})
        decision = await session.decide()
    if triple.awareness != "unknown":
        await session.report(decision["decision_id"], *RESULTS[triple.awareness])


@pytest.mark.parametrize("triple", TRIPLES, ids=lambda t: t.name)
async def test_each_triple_gives_the_model_s_cognitive_state(mesh: Mesh, triple: Triple) -> None:
    session = await mesh.session()
    await reach_state(session, triple)
    gaze = "distracted" if triple.gaze == "uncertain" else triple.gaze
    expected = MODEL[triple.capacity, gaze][["unknown", *RESULTS].index(triple.awareness)]
    for shown in (await session.read("strategy?task=grasp"), await session.decide()):
        assert shown["observation"] == triple._asdict()
        assert shown["cognitive_state"] == expected
