"""Study files as texts, and values outside their ranges."""

from __future__ import annotations

import json
from typing import Any

from ruamel.yaml import YAML

CONTRACT = """
study: coffee                        # an id
title: Making coffee with a robot
tasks: [grasp, turn, pour]           # left out: any id is a task
aois:                                # 0..1 from the upper left corner; where two overlap, the first counts
  - {name: robot, rectangle: [0.0, 0.0, 0.33, 1.0]}            # left, top, right, bottom
  - {name: cup, polygon: [[0.33, 0.0], [1.0, 0.0], [1.0, 1.0], [0.33, 1.0]]}
require_condition: false             # true: a start without a condition is refused
conditions:                          # each overrides parts of what stands below
  control: {learner: {name: scoring}}
  adaptive: {}
interactions: 100                    # planned number; epsilon reaches 0 there
capacity: {start: 1.0, min: 0.0, max: 1.0, recovery: 0.30, demanding_cost: 0.20, other_cost: 0.10, threshold: 0.5, demanding: [negation_affirmation, negation]}
attention: {step_s: 0.1, maximum_dwell_s: 1.0, minimum_dwell_s: 0.5, weight_step: 0.10, weight_min: 0.0, shift_increase: 0.20, shift_decrease: 0.05, focused_dominance: 0.5, focused_shift: 0.33, distracted_dominance: 0.35, distracted_shift: 0.66}
fixation: {method: i-dt, dispersion_deg: 2.0, minimum_duration_s: 0.06, median_filter_s: 0.03, maximum_gap_s: 0.075, screen_width_cm: 50.9, screen_height_cm: 28.6, distance_cm: 65.0}
awareness: {window: 1, threshold: 0.5}
reward: {decay: 0.1, scale: 1.0}
scoring:
  strategies:
    negation: {weight: 1.0, levels: [affirmation, negation_affirmation, negation], thresholds: [0.5, 0.8333333333333334]}
    hesitation: {weight: 1.0, levels: [none, hesitation], thresholds: [0.5]}
  table:                             # the paper's Table I: 0 or 1 for each category and strategy
    capacity: {low: {negation: 0, hesitation: 1}, high: {negation: 1, hesitation: 0}}
    gaze:
      distracted: {negation: 1, hesitation: 1}
      uncertain: {negation: 1, hesitation: 1}
      focused: {negation: 0, hesitation: 0}
    awareness:
      unknown: {negation: 0, hesitation: 1}
      failure: {negation: 0, hesitation: 1}
      misconception_enabledness: {negation: 1, hesitation: 0}
      misconception_comprehension: {negation: 0, hesitation: 1}
      success: {negation: 1, hesitation: 0}
decider: {wait_s: 2.0}                # how long a decision waits for what it must have seen
learner: {name: q-learning, learning_rate: 0.25, discount: 0.0, epsilon: 0.75, scoring_prior: true, prior_value: 1.0}
"""  # noqa: E501
"""The block of the contract as it stands there, its ``gaze: {...}`` written out from the paper's Table I."""


SHOWN: dict[str, Any] = YAML(typ="safe", pure=True).load(CONTRACT)


OUT_OF_RANGE = [
    ("study", "../x"), ("study", "a b"), ("title", "x" * 501), ("tasks", []), ("tasks", ["a", "a"]),
    ("tasks", ["a/b"]), ("tasks", "grasp"), ("interactions", 0), ("interactions", 1.5), ("interactions", True),
    *((f"capacity.{n}", v) for n in ("start", "min", "max", "recovery", "demanding_cost", "other_cost", "threshold")
      for v in (-0.1, "0.5", True)),
    ("capacity.demanding", ["shouting"]), ("capacity.demanding", "negation"),
    *((f"attention.{n}", -0.1) for n in ("shift_increase", "shift_decrease", "focused_shift", "distracted_shift")),
    *((f"attention.{n}", v) for n in ("weight_step", "weight_min", "focused_dominance", "distracted_dominance")
      for v in (-0.1, 1.1)),
    *((f"attention.{n}", v) for n in ("step_s", "maximum_dwell_s") for v in (-0.1, 0.0)),
    ("fixation.method", "i-vt"), ("fixation.median_filter_s", -0.01),
    *((f"fixation.{n}", v) for v in (-1.0, 0.0) for n in ("dispersion_deg", "minimum_duration_s", "maximum_gap_s",
      "screen_width_cm", "screen_height_cm", "distance_cm")),
    ("awareness.window", 0), ("awareness.window", 1.5), ("awareness.threshold", 1.1), ("awareness.threshold", -0.1),
    ("reward.decay", -0.1), ("reward.scale", -1), ("decider.wait_s", -1), ("decider.wait_s", "2"),
    ("learner.name", "deep"), ("learner.learning_rate", 1.1), ("learner.learning_rate", -0.1),
    ("learner.discount", 1.01), ("learner.discount", -0.1), ("learner.epsilon", 1.1), ("learner.epsilon", -0.1),
    ("learner.scoring_prior", "yes"), ("scoring.s_max", 0),
    ("scoring.strategies.negation.weight", -1), ("scoring.strategies.negation.levels", ["Aff", "neg", "x"]),
    ("scoring.strategies.negation.levels", ["a", "a", "b"]), ("scoring.strategies.negation.thresholds", [0.5]),
    ("scoring.strategies.negation.thresholds", [0.9, 0.1]), ("scoring.strategies.hesitation.thresholds", [-0.5]),
    ("scoring.table.gaze.focused.negation", 2), ("scoring.table.gaze.focused.negation", -1),
    ("scoring.table.capacity.low.negation", "1"),
]  # fmt: skip


def written(path: str, value: object) -> tuple[str, int]:
    """Return a study file in block style with ``value`` at ``path``, and the line of the value."""
    names = path.split(".")
    head = [] if path == "study" else ["study: x"]
    lines = [*head, *(f"{'  ' * i}{n}:" for i, n in enumerate(names[:-1]))]
    lines.append(f"{'  ' * (len(names) - 1)}{names[-1]}: {json.dumps(value)}")
    return "\n".join(lines), len(lines)


PACE = """
study: paced
scoring:
  strategies:
    pace: {levels: [slow, fast], thresholds: [0.5]}
  table:
    capacity: {low: {pace: 0}, high: {pace: 1}}
    gaze: {distracted: {pace: 0}, uncertain: {pace: 0}, focused: {pace: 1}}
    awareness:
      unknown: {pace: 0}
      failure: {pace: 0}
      misconception_enabledness: {pace: 0}
      misconception_comprehension: {pace: 0}
      success: {pace: 1}
"""
