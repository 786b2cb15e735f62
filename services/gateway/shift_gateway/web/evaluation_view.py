"""What the evaluation page shows of a result of ``shift-mesh evaluate``: the rows beside the paper's numbers. Pure."""

from __future__ import annotations

from typing import Any, Literal, get_args

Experiment = Literal["table2", "users"]
EXPERIMENTS: dict[Experiment, str] = {
    "table2": "Table II: twelve settings of the Q-learner with user A",
    "users": "Users A to D, with and without the scoring prior",
}
PAPER_RUNS = 500
"""The number of simulated sessions of each row in the paper."""
assert set(EXPERIMENTS) == set(get_args(Experiment))


def table_rows(experiment: Experiment, result: dict[str, Any]) -> list[dict[str, str]]:
    """Return the rows of the table: ours, and the paper's where it gives the number."""
    return [_table2_row(row) for row in result["rows"]] if experiment == "table2" else _user_rows(result)


def _table2_row(row: dict[str, Any]) -> dict[str, str]:
    paper = row["paper"]
    return {
        "row": str(row["row"]),
        "prior": "yes" if row["prior"] else "no",
        "learning rate": f"{row['learning_rate']:g}",
        "discount": f"{row['discount']:g}",
        "Z (sd)": f"{row['z_mean']:.2f} ({row['z_sd']:.2f})",
        "paper's Z (sd)": f"{paper['z_mean']:.2f} ({paper['z_sd']:.2f})",
        "R (sd)": f"{row['r_mean']:.2f} ({row['r_sd']:.2f})",
        "paper's R (sd)": f"{paper['r_mean']:.2f} ({paper['r_sd']:.2f})",
    }


def _user_rows(result: dict[str, Any]) -> list[dict[str, str]]:
    return [
        {
            "user": row["user"],
            "prior": "yes" if row["prior"] else "no",
            "break-even after": "never" if row["crossing"] is None else f"{row['crossing']} interactions",
            "reward (standard error)": f"{row['reward_mean']:.2f} ({row['reward_se']:.2f})",
        }
        for row in result["users"]
    ]


def criterion_lines(result: dict[str, Any]) -> list[tuple[bool, str]]:
    """Return for each point of the frozen criterion whether it holds, and its sentence."""
    return [(p["passed"], f"{p['point']}: {'holds' if p['passed'] else 'does not hold'}; {p['detail']}")
            for p in result["criterion"]]  # fmt: skip


def figure_options(experiment: Experiment, result: dict[str, Any]) -> dict[str, Any]:
    """Return the ECharts options of the figure: rewards beside the paper's, or the users' curves."""
    return _table2_figure(result) if experiment == "table2" else _users_figure(result)


def _table2_figure(result: dict[str, Any]) -> dict[str, Any]:
    rows = result["rows"]
    series = [
        {"name": name, "type": "bar", "data": [round(r["r_mean"], 2) for r in shown]}
        for name, shown in (("R", rows), ("R of the paper", [r["paper"] for r in rows]))
    ]
    return {
        "animation": False,
        "aria": {"enabled": True, "decal": {"show": True}},
        "tooltip": {"trigger": "axis", "renderMode": "richText", "confine": True},
        "legend": {"top": 0},
        "grid": {"left": 8, "right": 8, "top": 30, "bottom": 24, "containLabel": True},
        "xAxis": {"type": "category", "data": [f"row {r['row']}" for r in rows]},
        "yAxis": {"type": "value", "name": "R"},
        "series": series,
    }


def _users_figure(result: dict[str, Any]) -> dict[str, Any]:
    return {
        "animation": False,
        "aria": {"enabled": True},
        "tooltip": {"trigger": "axis", "renderMode": "richText", "confine": True},
        "legend": {"top": 0},
        "grid": {"left": 8, "right": 16, "top": 50, "bottom": 24, "containLabel": True},
        "xAxis": {"type": "value", "name": "interaction", "nameLocation": "middle", "nameGap": 22, "min": 1},
        "yAxis": {"type": "value", "name": "cumulative reward"},
        "series": [
            {
                "name": f"{curve['user']}, {'prior' if curve['prior'] else 'no prior'}", "type": "line",
                "showSymbol": False, "lineStyle": {"width": 2, "type": "solid" if curve["prior"] else "dashed"},
                "data": [[i, round(v, 3)] for i, v in enumerate(curve["mean"], 1)],
            }
            for curve in result["curves"]
        ],
    }  # fmt: skip
