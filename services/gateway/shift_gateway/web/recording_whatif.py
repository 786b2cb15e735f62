"""A recording under another study or learner, in a process of its own, and what the page says about the answer."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

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
    return WhatIfResult(sentence, counts, values, answer.warnings)
