"""The learner's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from shift_runtime.service.core import Core
from shift_schemas.registry import READS

from shift_learner import core
from shift_learner.core import LearnerState

CORE: Core[LearnerState] = Core(
    name="learner",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["learner"],
)
