"""The monitor's shell: what it takes in, by whom. The worker does the rest."""

from __future__ import annotations

from shift_runtime.worker import Core
from shift_schemas.keys import READS

from shift_monitor import core
from shift_monitor.core import MonitorState

CORE: Core[MonitorState] = Core(
    name="monitor",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["monitor"],
)
