"""The criterion for reproducing the paper (docs/model.md, section 5). It was frozen before the first run."""

from __future__ import annotations

from typing import Any

Point = dict[str, Any]
Rows = list[dict[str, Any]]

CROSSINGS: dict[tuple[str, bool], tuple[float, float] | None] = {
    ("A", True): (42, 4),
    ("A", False): (63, 4),
    ("B", True): (11, 3),
    ("B", False): (14, 4),
    ("C", True): (75, 15),
    ("C", False): None,
    ("D", True): None,
    ("D", False): None,
}
"""Break-even of the mean curve, by user and prior: (episode, tolerance), or None for never."""


def point(name: str, failures: list[str], statement: str) -> Point:
    """Return the verdict on one point; its detail is the failures, or else the statement that holds."""
    return {"point": name, "passed": not failures, "detail": "; ".join(failures) or statement}


def passed(criterion: list[Point]) -> bool:
    """Return whether every point holds."""
    return all(p["passed"] for p in criterion)


# --- Table II ---


def table2_criterion(rows: Rows) -> list[Point]:
    """Return the verdicts on points 1 to 3, one for each part."""
    return [
        point("1 prior beats none", _prior_failures(rows), "Z lower, R higher, R's sd lower in all six pairs"),
        point("2 R near the paper", _absolute_failures(rows, "r_mean", 1.5, 1.5), "|R - paper| <= 1.5 in all rows"),
        point(
            "2 Z near the paper",
            _absolute_failures(rows, "z_mean", 7, 5),
            "|Z - paper| <= 7 without the prior, 5 with it",
        ),
        point("3 sd of Z", _relative_failures(rows, "z_sd", 0.20), "within 20 % of the paper in all rows"),
        point("3 sd of R", _relative_failures(rows, "r_sd", 0.15), "within 15 % of the paper in all rows"),
        point("3 lowest rewards", _order_failures(rows), "row 11 has the lowest R, then row 5"),
    ]


def _prior_failures(rows: Rows) -> list[str]:
    return [
        f"{key}: row {with_prior['row']} has {with_prior[key]:.2f}, row {without['row']} {without[key]:.2f}"
        for without, with_prior in zip(rows[::2], rows[1::2], strict=True)
        for key, sign in (("z_mean", -1), ("r_mean", 1), ("r_sd", -1))
        if sign * (with_prior[key] - without[key]) <= 0
    ]


def _absolute_failures(rows: Rows, key: str, without: float, with_prior: float) -> list[str]:
    return [
        f"row {r['row']}: {r[key]:.2f} is not within {limit} of {r['paper'][key]:.2f}"
        for r in rows
        if abs(r[key] - r["paper"][key]) > (limit := with_prior if r["prior"] else without)
    ]


def _relative_failures(rows: Rows, key: str, share: float) -> list[str]:
    return [
        f"row {r['row']}: {r[key]:.2f} is not within {share:.0%} of {r['paper'][key]:.2f}"
        for r in rows
        if abs(r[key] - r["paper"][key]) > share * r["paper"][key]
    ]


def _order_failures(rows: Rows) -> list[str]:
    lowest = [r["row"] for r in sorted(rows, key=lambda r: float(r["r_mean"]))[:2]]
    return [] if lowest == [11, 5] else [f"the lowest R are rows {lowest[0]} and {lowest[1]}"]


# --- users A to D ---


def users_criterion(rows: Rows) -> list[Point]:
    """Return the verdicts on point 4: each user's crossings, the order of B's crossings, the order of rewards."""
    by = {(r["user"], r["prior"]): r for r in rows}
    points = [
        point(f"4 crossings of {user}", _crossing_failures(by, user), _expected_crossings(user))
        for user in dict.fromkeys(u for u, _ in by)
    ]
    b = [by[("B", prior)]["crossing"] for prior in (True, False)]
    late = [] if None not in b and b[0] < b[1] else [f"B crosses at {b[0]} with the prior and at {b[1]} without"]
    lower = [
        f"{user}: {by[(user, True)]['reward_mean']:.2f} with, {by[(user, False)]['reward_mean']:.2f} without"
        for user in dict.fromkeys(u for u, _ in by)
        if by[(user, True)]["reward_mean"] <= by[(user, False)]["reward_mean"]
    ]
    return [
        *points,
        point("4 B with the prior first", late, f"{b[0]} before {b[1]}"),
        point("4 R with the prior above R without", lower, "for A to D"),
    ]


def _crossing_failures(by: dict[tuple[str, bool], dict[str, Any]], user: str) -> list[str]:
    return [
        f"{'with' if prior else 'without'} the prior: {found or 'never'}, wanted {_tolerance_text(wanted)}"
        for prior in (True, False)
        for found, wanted in [(by[(user, prior)]["crossing"], CROSSINGS[(user, prior)])]
        if not _within_tolerance(found, wanted)
    ]


def _within_tolerance(found: int | None, wanted: tuple[float, float] | None) -> bool:
    if found is None or wanted is None:
        return found is None and wanted is None
    return abs(found - wanted[0]) <= wanted[1]


def _expected_crossings(user: str) -> str:
    with_prior, without = (_tolerance_text(CROSSINGS[(user, prior)]) for prior in (True, False))
    return f"{with_prior} with the prior, {without} without"


def _tolerance_text(wanted: tuple[float, float] | None) -> str:
    return "never" if wanted is None else f"{wanted[0]:g} +- {wanted[1]:g}"
