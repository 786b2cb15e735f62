"""Tables of a what-if: each decision both ways, and the policy of the people who overrode SHIFT. Pure."""

from __future__ import annotations

import csv
import io
from typing import Any

from shift_study.prior_file import FORMAT

from shift_analysis.whatif import WhatIf

COLUMNS = ("participant", "session", "n", "decision_id", "task", "policy_source", "cognitive_state",
           "other_cognitive_state", "strategy", "own_strategy", "other_strategy", "differs", "propensity",
           "other_propensity", "weight", "reward", "supported")  # fmt: skip


def decisions_csv(answer: WhatIf) -> str:
    """Return a CSV with one row for each decision; an empty cell is a value that there is not."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for recording in answer.recordings:
        names = recording.actions
        for each in recording.decisions:
            other = each.other_probabilities[each.action]
            writer.writerow([
                recording.participant, recording.session, each.n, each.decision_id, each.task, each.source, each.state,
                each.other_state, names[each.action], names[each.own], names[each.other_action], each.differs,
                each.propensity, other, other / each.propensity if each.propensity else None, each.reward,
                each.is_supported,
            ])  # fmt: skip
    return text.getvalue()


def wizard_table(answer: WhatIf) -> dict[str, Any]:
    """Return the policy of the people who overrode SHIFT: how often each strategy was chosen in each state.

    A study can start from it: ``learner: {prior: FILE}``.
    """
    states = {
        name: {action: count / state.overrides for action, count in zip(answer.actions, state.chosen, strict=True)}
        for name, state in answer.wizard.items()
    }
    return {
        "format": FORMAT, "actions": list(answer.actions),
        "overrides": {name: state.overrides for name, state in answer.wizard.items()}, "states": states,
    }  # fmt: skip
