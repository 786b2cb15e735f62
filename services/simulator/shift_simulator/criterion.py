"""What counts as reproducing the paper: the criterion of MODEL.md, section 5, frozen before the first run."""

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


def point(name: str, failures: list[str], fine: str) -> Point:
    """A verdict: what failed, or what holds."""
    return {"point": name, "passed": not failures, "detail": "; ".join(failures) or fine}


def passed(criterion: list[Point]) -> bool:
    """Whether every point holds."""
    return all(p["passed"] for p in criterion)


# --- Table II ---


def table2_criterion(rows: Rows) -> list[Point]:
    """Points 1 to 3, each part by itself."""
    return [
        point("1 prior beats none", _prior_loses(rows), "Z lower, R higher, R's sd lower in all six pairs"),
        point("2 R near the paper", _far(rows, "r_mean", 1.5, 1.5), "|R - paper| <= 1.5 in all rows"),
        point("2 Z near the paper", _far(rows, "z_mean", 7, 5), "|Z - paper| <= 7 without the prior, 5 with it"),
        point("3 sd of Z", _relative(rows, "z_sd", 0.20), "within 20 % of the paper in all rows"),
        point("3 sd of R", _relative(rows, "r_sd", 0.15), "within 15 % of the paper in all rows"),
        point("3 lowest rewards", _order(rows), "row 11 has the lowest R, then row 5"),
    ]


def _prior_loses(rows: Rows) -> list[str]:
    return [
        f"{key}: row {with_prior['row']} has {with_prior[key]:.2f}, row {without['row']} {without[key]:.2f}"
        for without, with_prior in zip(rows[::2], rows[1::2], strict=True)
        for key, sign in (("z_mean", -1), ("r_mean", 1), ("r_sd", -1))
        if sign * (with_prior[key] - without[key]) <= 0
    ]


def _far(rows: Rows, key: str, without: float, with_prior: float) -> list[str]:
    return [
        f"row {r['row']}: {r[key]:.2f} is not within {limit} of {r['paper'][key]:.2f}"
        for r in rows
        if abs(r[key] - r["paper"][key]) > (limit := with_prior if r["prior"] else without)
    ]


def _relative(rows: Rows, key: str, share: float) -> list[str]:
    return [
        f"row {r['row']}: {r[key]:.2f} is not within {share:.0%} of {r['paper'][key]:.2f}"
        for r in rows
        if abs(r[key] - r["paper"][key]) > share * r["paper"][key]
    ]


def _order(rows: Rows) -> list[str]:
    lowest = [r["row"] for r in sorted(rows, key=lambda r: float(r["r_mean"]))[:2]]
    return [] if lowest == [11, 5] else [f"the lowest R are rows {lowest[0]} and {lowest[1]}"]


# --- users A to D ---


def users_criterion(rows: Rows) -> list[Point]:
    """Point 4: the crossings per user, the prior first for B, and R with the prior above R without."""
    by = {(r["user"], r["prior"]): r for r in rows}
    points = [
        point(f"4 crossings of {user}", _crossings(by, user), _wanted(user)) for user in dict.fromkeys(u for u, _ in by)
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


def _crossings(by: dict[tuple[str, bool], dict[str, Any]], user: str) -> list[str]:
    return [
        f"{'with' if prior else 'without'} the prior: {found or 'never'}, wanted {_said(wanted)}"
        for prior in (True, False)
        for found, wanted in [(by[(user, prior)]["crossing"], CROSSINGS[(user, prior)])]
        if not _near(found, wanted)
    ]


def _near(found: int | None, wanted: tuple[float, float] | None) -> bool:
    if found is None or wanted is None:
        return found is None and wanted is None
    return abs(found - wanted[0]) <= wanted[1]


def _wanted(user: str) -> str:
    return f"{_said(CROSSINGS[(user, True)])} with the prior, {_said(CROSSINGS[(user, False)])} without"


def _said(wanted: tuple[float, float] | None) -> str:
    return "never" if wanted is None else f"{wanted[0]:g} +- {wanted[1]:g}"
