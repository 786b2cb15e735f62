"""What the desk view shows, compared with what REST answers."""

from __future__ import annotations

import pytest
from shift_gateway.web.desk_charts import probability_update, reward_update
from shift_gateway.web.desk_view import (
    awareness_rows,
    decision_rows,
    desk_numbers,
    facts_so_far,
    parts_of,
    probability_rows,
    reward_points,
    score_rows,
    scores_text,
    selected_decision,
)
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.table_rows import Cell, Row
from support.gateway_mesh import START_NS, STUDY, Mesh
from support.page_history import history_of

pytestmark = pytest.mark.anyio


def texts(row: Row) -> list[str]:
    """Return what a row shows."""
    return [c if isinstance(c, str) else c.button.text if c.button else c.text for c in row.cells]


async def test_numbers_are_those_of_rest(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.look(["cup", "cup", "robot", "robot"])
    await session.report((await session.decide())["decision_id"])
    numbers = desk_numbers(await history_of(session), START_NS)
    policy, observation = await session.read("policy"), await session.read("observation")
    assert numbers.epsilon == f"{policy['epsilon']:.2f}"
    assert numbers.cumulative_reward == f"{policy['cumulative_reward']:.2f}"
    assert numbers.focus_shift == f"{observation['gaze']['focus_shift']:.2f}"
    assert not numbers.paused
    await session.configure({"learner": {"paused": True}})
    assert desk_numbers(await history_of(session), START_NS).paused


async def test_history_has_every_decision_with_the_reward_in_force(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    first, second = await session.decide(), await session.decide("turn")
    await session.report(first["decision_id"])
    corrected = {"success": False, "duration_s": 1.0}
    body = {"decision_id": first["decision_id"], "comprehension": corrected, "enabledness": corrected}
    answer = await session.done("performance", {**body, "corrects": True})
    history = await history_of(session)
    newest, oldest = decision_rows(history, 1)
    assert (texts(newest)[0], newest.classes, texts(newest)[8]) == ("2", "", "–")
    assert (texts(oldest)[0], oldest.classes) == ("1", "selected")
    assert texts(oldest)[8] == f"{answer['reward']:.2f} (corrected)"
    assert texts(oldest)[6] == f"{first['propensity']:.2f}"
    assert texts(newest)[3] == "/".join(second["observation"].values())
    assert selected_decision(history, 1).n == 1  # type: ignore[union-attr]
    assert selected_decision(history, 99).n == 2  # type: ignore[union-attr]
    assert len(reward_points(history)) == 2
    assert reward_update([(1, 0.5)]) == {"series": [{"data": [[1, 0.5]]}]}


async def test_scores_follow_from_the_configuration_of_the_decision(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.configure({"scoring": {"strategies": {"negation": {"weight": 0.5}}}})
    decision = await session.decide()
    await session.configure({"scoring": {"strategies": {"negation": {"weight": 0.9}}}})
    history = await history_of(session)
    made = selected_decision(history, None)
    assert {p.strategy: p.score for p in parts_of(history, made)} == decision["scores"]
    assert [texts(row)[0] for row in score_rows(parts_of(history, made))] == list(decision["scores"])
    assert scores_text(made) == ", ".join(f"{n} {s:.2f}" for n, s in decision["scores"].items())
    rows = probability_rows(made)
    assert [texts(row)[1] for row in rows] == [f"{p:.2f}" for p in decision["probabilities"]]
    (chosen,) = [texts(row)[0] for row in rows if "chosen" in texts(row)[2]]
    assert chosen == ", ".join(decision["strategy"].values())
    assert [name.startswith("→ ") for name in probability_update(made)["yAxis"]["data"]].count(True) == 1


async def test_awareness_has_both_dimensions_of_each_task(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.report((await session.decide("turn"))["decision_id"], understood=True, able=False)
    (row,) = awareness_rows((await history_of(session)).observation())
    seen = (await session.read("observation"))["awareness"]["turn"]
    assert row.name == "awareness-turn"
    assert texts(row) == ["turn", seen["category"], "1.00", "0.00", "1"]
    assert [c.bar for c in row.cells if isinstance(c, Cell)] == [1.0, 0.0]


def test_empty_history_has_texts_for_what_does_not_exist() -> None:
    history = SessionHistory()
    assert desk_numbers(history, START_NS).focus_shift == "–"
    assert decision_rows(history, None) == []
    assert texts(probability_rows(None)[0])[0] == "no decision yet"
    assert texts(awareness_rows(None)[0])[0] == "no results yet"
    assert (scores_text(None), parts_of(history, None), probability_update(None)) == ("–", (), {})
    assert facts_so_far(history) == (0,) * 8
