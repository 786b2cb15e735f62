"""The table of values as a heat map: states x actions, as many as the policy has, with visits. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from shift_schemas.messages import Policy, PolicyRow

from shift_gateway.web.table_rows import Cell, Heading, Row
from shift_gateway.web.wording import levels

Scale = tuple[float, float]
"""The smallest and the largest value: no colour and the strongest one."""


def value_scale(policies: Iterable[Policy | None]) -> Scale:
    """Return the scale on which all these policies are coloured, so that they can be compared."""
    values = [v for p in policies if p is not None for row in p.states.values() for v in row.values]
    return (min(values), max(values)) if values else (0.0, 0.0)


def value_headings(policy: Policy | None) -> list[Heading | str]:
    """Return the headings: the state, and one action each."""
    return ["state", *(levels(action) for action in policy.actions)] if policy is not None else ["state"]


def value_rows(policy: Policy | None, scale: Scale) -> list[Row]:
    """Return a row for each state; each cell has the value of an action and how often it was reported there."""
    if policy is None:
        return [Row(["no policy yet"])]
    return [Row([state, *_cells(row, scale)]) for state, row in policy.states.items()]


def _cells(row: PolicyRow, scale: Scale) -> list[Cell]:
    best = max(row.probabilities, default=0.0)
    return [
        Cell(
            f"{value:.2f}", small=f"n {visits}", heat=_share(value, scale),
            classes="heat best" if probability == best else "heat",
        )
        for value, visits, probability in zip(row.values, row.visits, row.probabilities, strict=True)
    ]  # fmt: skip


def _share(value: float, scale: Scale) -> float:
    low, high = scale
    return round((value - low) / (high - low), 3) if high > low else 0.0
