"""Recognition of arrays, and the scalar path of the model without numpy."""

import subprocess
import sys

import numpy as np
from shift_model.arrays import is_array

SCALAR_PATH = """
import sys
from shift_model.capacity import next_capacity
from shift_model.random_numbers import uniform
from shift_model.q_learning import updated_value
from shift_model.reward import task_performance
from shift_model.scoring import level_index, scaffolding_score
from shift_monitor import core as monitor
from shift_decider import core as decider
assert next_capacity(0.5, False, 0.1, recovery=0.3, minimum=0.0, maximum=1.0) == 0.4
assert level_index(scaffolding_score((1.0, 0.0, 1.0), 1.0, 3.0), [0.5]) == 1
assert task_performance(True, 0.0, 0.1) == updated_value(1.0, 1.0, 0.0, learning_rate=0.5, discount=0.0)
assert 0.0 <= uniform(7, 1) < 1.0
assert "numpy" not in sys.modules
"""


def test_only_arrays_are_arrays() -> None:
    assert is_array(np.zeros(2))
    assert is_array(np.array(0.5))
    assert not any(is_array(value) for value in (0.5, 1, np.float64(0.5), [0.5], (0.5,)))


def test_scalar_path_the_monitor_and_the_decider_do_not_import_numpy() -> None:
    subprocess.run([sys.executable, "-c", SCALAR_PATH], check=True, timeout=60)
