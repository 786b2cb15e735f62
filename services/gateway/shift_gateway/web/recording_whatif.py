"""A recording under another study or learner, in a process of its own, and what the page says about the answer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from shift_analysis.off_policy import Estimate
from shift_analysis.whatif import OtherPolicy, WhatIf, compare_recording, what_if
from shift_schemas.errors import DamagedRecording

from shift_gateway.web.table_rows import Row
from shift_gateway.web.worker_process import Send

WORK = f"{__name__}:send_what_if"
NAMES = {"logged": "recorded", "ips": "IPS", "snips": "SNIPS", "dr": "doubly robust"}


class WhatIfResult(NamedTuple):
    """What the page shows of an answer."""

    sentence: str
    counts: list[Row]
    """Cognitive state or strategy, how often it was recorded, and how often it would have been."""
    values: list[Row]
    """Estimator, estimate, interval, effective sample size."""
    warnings: list[str]
    chart: dict[str, Any]
    """The options of the chart: values with their intervals, and the numbers of states and strategies."""


def send_what_if(send: Send, path: str, study: str, learner: str) -> None:
    """Decide the recording again, and send the answer. ``study`` is JSON, or empty for the recorded one."""
    found = compare_recording(Path(path), OtherPolicy(study, learner))
    if found.problem:
        raise DamagedRecording(found.problem)
    send(result_of(what_if([found])))


def result_of(answer: WhatIf) -> WhatIfResult:
    """Return what the page shows of an answer."""
    decisions = answer.decisions
    differ = sum(each.differs for each in decisions)
    counts = [
        Row((name.replace("_", " "), str(recorded), str(other)))
        for table in (answer.states, answer.strategies)
        for name, (recorded, other) in table.items()
    ]
    values = [
        Row((
            NAMES[each.estimator], f"{each.estimate:.3f}",
            "-" if each.low is None or each.high is None else f"{each.low:.3f} to {each.high:.3f}", f"{each.ess:.1f}",
        ))
        for each in [*([answer.logged] if answer.logged else []), *answer.value]
    ]  # fmt: skip
    sentence = f"{differ} of {len(decisions)} decisions would have used another strategy."
    return WhatIfResult(sentence, counts, values, answer.warnings, chart_options(answer))


def chart_options(answer: WhatIf) -> dict[str, Any]:
    """Return the chart: above, the values with their intervals; below, how often each state and strategy was chosen."""
    estimates = [*([answer.logged] if answer.logged else []), *answer.value]
    names = [name.replace("_", " ") for name in (*answer.states, *answer.strategies)]
    pairs = [*answer.states.values(), *answer.strategies.values()]
    above, below = 26 * (len(estimates) or 1), 34 * len(names)
    label = {"width": 230, "overflow": "truncate"}
    return {
        "animation": False,
        "aria": {"enabled": True, "decal": {"show": True}},
        "tooltip": {},
        "legend": {"data": ["recorded", "other"], "top": above + 44},
        "grid": [
            {"left": 250, "right": 24, "top": 12, "height": above},
            {"left": 250, "right": 24, "top": above + 76, "height": below},
        ],
        "xAxis": [
            {"type": "value", "gridIndex": 0, "scale": True, "name": "reward"},
            {"type": "value", "gridIndex": 1, "name": "decisions"},
        ],
        "yAxis": [
            {"type": "category", "gridIndex": 0, "inverse": True, "data": [NAMES[e.estimator] for e in estimates]},
            {"type": "category", "gridIndex": 1, "inverse": True, "data": names, "axisLabel": label},
        ],
        "series": [*_bars(pairs), *_intervals(estimates)],
        "height": above + below + 110,
    }  # fmt: skip


def _intervals(estimates: Sequence[Estimate]) -> list[dict[str, Any]]:
    on = {"xAxisIndex": 0, "yAxisIndex": 0, "silent": True}
    points = [[each.estimate, NAMES[each.estimator]] for each in estimates]
    ends = [
        end
        for each in estimates
        if each.low is not None
        for end in ([each.low, NAMES[each.estimator]], [each.high, NAMES[each.estimator]], ["-", "-"])
    ]
    line = {"type": "line", **on, "symbol": "none", "lineStyle": {"width": 3}, "data": ends}
    return [line, {"type": "scatter", **on, "symbolSize": 11, "data": points}]


def _bars(pairs: Sequence[Sequence[int]]) -> list[dict[str, Any]]:
    on = {"type": "bar", "xAxisIndex": 1, "yAxisIndex": 1}
    return [{"name": name, **on, "data": [pair[i] for pair in pairs]} for i, name in enumerate(("recorded", "other"))]
