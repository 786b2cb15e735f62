"""The list of changes, and what each one's button would do."""

from __future__ import annotations

import pytest
from shift_gateway.web.change_list import Change, change_rows, changes, differences, inverse_patch, undo_patch
from shift_study.patching import merge_patch
from support.gateway_mesh import NEGATED, PLAIN, STUDY, Mesh
from support.page_history import history_of

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ({"a": 1}, {"a": 2}),
        ({"a": {"b": 1, "c": [1, 2]}}, {"a": {"b": 1, "c": [1]}}),
        ({"a": {"b": 1}}, {"a": {"b": 1, "c": 0.5}}),
        ({"a": {"b": 1, "c": 0.5}}, {"a": {"b": 1}}),
    ],
)
def test_inverse_patch_puts_the_old_values_back(before: dict[str, object], after: dict[str, object]) -> None:
    assert merge_patch(after, inverse_patch(differences(before, after))) == before


def test_equal_studies_have_no_differences() -> None:
    assert differences({"a": {"b": [1]}}, {"a": {"b": [1]}}) == {}


def by_kind(found: list[Change]) -> dict[str, tuple[str, str]]:
    """Return state and action of each change."""
    return {c.kind: (c.now, c.action) for c in found}


async def test_configuration_can_be_undone_while_its_values_hold(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.configure({"reward": {"scale": 2}})
    await session.configure({"reward": {"scale": 3}, "capacity": {"recovery": 0.2}})
    history = await history_of(session)
    assert by_kind(changes(history)) == {
        "configuration 2": ("undone or changed again", ""), "configuration 3": ("in force", "undo"),
    }  # fmt: skip
    assert undo_patch(history, 1) is None
    assert undo_patch(history, 2) is None
    patch = undo_patch(history, 3)
    assert patch == {"reward": {"scale": 2.0}, "capacity": {"recovery": 0.3}}
    await session.configure(patch)
    history = await history_of(session)
    assert by_kind(changes(history)) == {
        "configuration 2": ("in force", "undo"), "configuration 3": ("undone or changed again", ""),
        "configuration 4": ("in force", "undo"),
    }  # fmt: skip
    (line,) = [c.what for c in changes(history) if c.kind == "configuration 2"]
    assert line == "reward.scale 1.0 → 2.0"


async def test_overrides_say_what_became_of_them(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)

    async def override(task: str, override_id: str) -> None:
        body = {"task": task, "strategy": NEGATED, "override_id": override_id, "author": "Anna"}
        await session.done("override", body)

    await override("grasp", "used")
    await session.decide("grasp")
    await override("turn", "replaced")
    await override("turn", "waiting")
    await override("grasp", "gone")
    await session.done("override", {"task": "grasp", "withdraws": "gone", "author": "Ben"})
    found = changes(await history_of(session))
    assert {c.target: (c.author, c.now, c.action) for c in found if c.kind == "override"} == {
        "used": ("Anna", "used by decision 1", ""), "replaced": ("Anna", "replaced", ""),
        "waiting": ("Anna", "waits for the task's next decision", "withdraw"), "gone": ("Anna", "withdrawn", ""),
    }  # fmt: skip
    assert [(c.author, c.what) for c in found if c.kind == "withdrawal"] == [("Ben", "override gone of grasp")]


async def test_marker_can_be_retracted_once(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.done("markers", {"text": "wrong", "marker_id": "m1"})
    await session.done("markers", {"text": "right", "marker_id": "m2"})
    await session.done("markers", {"text": "it was wrong", "retracts": "m1", "author": "Anna"})
    found = changes(await history_of(session))
    assert {c.what: (c.now, c.action, c.target) for c in found} == {
        "wrong": ("retracted", "", "m1"), "right": ("", "retract", "m2"), "marker “wrong”": ("", "", ""),
    }  # fmt: skip


async def test_results_are_listed_if_a_person_entered_or_corrected_them(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    result = {"success": True, "duration_s": 0.0}
    body = {"comprehension": result, "enabledness": result}
    first, second = await session.decide(), await session.decide("turn")
    await session.report(first["decision_id"])
    await session.done("performance", {"decision_id": second["decision_id"], "author": "Anna", **body})
    await session.done("performance", {"decision_id": first["decision_id"], "corrects": True, **body})
    found = changes(await history_of(session))
    assert [(c.kind, c.author, c.what.split(":")[0]) for c in found] == [
        ("result", "Anna", "decision 2, turn"), ("corrected result", "", "decision 1, grasp"),
    ]  # fmt: skip


def test_rows_have_a_button_where_there_is_an_action() -> None:
    made = [Change(0, "configuration 2", "", "x", "in force", "undo", "2"), Change(0, "marker", "", "y", "retracted")]
    buttons = [row.cells[-1].button for row in change_rows(made) if not isinstance(row.cells[-1], str)]
    assert [(b.name, b.value) for b in buttons if b] == [("undo", "undo 2")]
    assert [row.cells[0] for row in change_rows([])] == ["no change yet"]


async def test_strategy_of_an_override_is_shown(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    await session.done("override", {"task": "grasp", "strategy": PLAIN, "reason": "too fast"})
    (found,) = changes(await history_of(session))
    assert found.what == f"grasp: {', '.join(PLAIN.values())} (too fast)"
