"""The monitor's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from typing import Any

from shift_runtime.service.core import Core, Recall
from shift_schemas.messages import GazeChunk
from shift_schemas.registry import READS

from shift_monitor import core
from shift_monitor.core import MonitorState
from shift_monitor.gaze_input import ChunkWithHistory, gaze_input
from shift_monitor.state import may_be_used


def prepared(state: MonitorState | None, message: Any, recall: Recall) -> Any:
    """Return a chunk of gaze together with what was recorded under its number before, if its number may be used."""
    if not isinstance(message, GazeChunk):
        return message
    return gaze_input(message, recall) if may_be_used(state, message) else ChunkWithHistory(message)


CORE: Core[MonitorState] = Core(
    name="monitor",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["monitor"],
    prepare=prepared,
    held=core.held,
    refused=core.refused,
    lookups={"gaze": ("source", "seq")},
)
