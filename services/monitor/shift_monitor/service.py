"""The monitor as a service: its core, the streams that it reads, and the lookup that its gaze needs."""

from __future__ import annotations

from typing import Any

from shift_runtime.service.core import Core, Recall
from shift_schemas.messages import GazeChunk
from shift_schemas.registry import READS

from shift_monitor import core
from shift_monitor.core import MonitorState
from shift_monitor.gaze_input import gaze_input


def add_earlier_gaze(message: Any, recall: Recall) -> Any:
    """Return a chunk of gaze with the records of its number; return any other message unchanged."""
    return gaze_input(message, recall) if isinstance(message, GazeChunk) else message


CORE: Core[MonitorState] = Core(
    name="monitor",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["monitor"],
    prepare=add_earlier_gaze,
    lookups={"gaze": ("source", "seq")},
    streams={"gaze": GazeChunk},
)
