"""The monitor's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from typing import Any

from shift_runtime.service.core import Core, Recall
from shift_schemas.messages import GazeChunk
from shift_schemas.registry import READS

from shift_monitor import core
from shift_monitor.core import MonitorState
from shift_monitor.gaze_input import gaze_input


def prepared(message: Any, recall: Recall) -> Any:
    """Return a chunk of gaze together with the fact that was recorded under its number before."""
    return gaze_input(message, recall) if isinstance(message, GazeChunk) else message


CORE: Core[MonitorState] = Core(
    name="monitor",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["monitor"],
    prepare=prepared,
    lookups={"gaze": ("source", "seq")},
    streams={"gaze": GazeChunk},
)
