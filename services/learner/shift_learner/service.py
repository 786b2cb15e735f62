"""The learner's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from shift_runtime.service.core import Core, Parts
from shift_schemas.registry import READS

from shift_learner import core
from shift_learner.core import LearnerState
from shift_learner.state import dump_part, parts_of, restore_parts, without_parts

CORE: Core[LearnerState] = Core(
    name="learner",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["learner"],
    parts=Parts(parts_of, without_parts, dump_part, restore_parts),
)
