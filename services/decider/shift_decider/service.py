"""The decider's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from shift_runtime.service.core import Core
from shift_schemas.registry import READS

from shift_decider import core
from shift_decider.core import DeciderState

CORE: Core[DeciderState] = Core(
    name="decider",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["decider"],
)
