"""The table of values: one row for each state that the policy has."""

from __future__ import annotations

from shift_gateway.web.table_rows import Cell
from shift_gateway.web.value_table import value_headings, value_rows, value_scale
from shift_schemas.messages import Policy, PolicyRow
from shift_schemas.timestamps import Stamp


def policy(**rows: tuple[list[float], list[float], list[int]]) -> Policy:
    """Return a policy on two actions; each row has probabilities, values and visits."""
    states = {n: PolicyRow(probabilities=p, values=v, visits=c) for n, (p, v, c) in rows.items()}
    return Policy(
        session="s1", stamp=Stamp.of(0), version=1, learner="q-learning", for_n=1,
        actions=[{"negation": "affirmation"}, {"negation": "negation"}], states=states,
    )  # fmt: skip


def test_each_state_of_the_policy_has_a_row_however_many_there_are() -> None:
    found = policy(**{f"state{i}": ([0.5, 0.5], [0.0, 1.0], [0, i]) for i in range(9)})
    rows = value_rows(found, value_scale([found]))
    assert [row.cells[0] for row in rows] == [f"state{i}" for i in range(9)]
    assert value_headings(found) == ["state", "affirmation", "negation"]


def test_cells_have_value_visits_and_share_of_the_scale() -> None:
    now, prior = policy(a=([0.9, 0.1], [0.5, -1.0], [3, 1])), policy(a=([0.5, 0.5], [1.0, 0.0], [0, 0]))
    (row,) = value_rows(now, value_scale([now, prior]))
    first, second = row.cells[1:]
    assert isinstance(first, Cell)
    assert isinstance(second, Cell)
    assert (first.text, first.small, first.heat, first.classes) == ("0.50", "n 3", 0.75, "heat best")
    assert (second.text, second.small, second.heat, second.classes) == ("-1.00", "n 1", 0.0, "heat")


def test_session_without_a_policy_says_so() -> None:
    assert [row.cells for row in value_rows(None, value_scale([None]))] == [["no policy yet"]]
