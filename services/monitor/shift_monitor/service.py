"""The monitor's shell: its core and the owners that it reads. The worker does the rest."""

from __future__ import annotations

from typing import Any

from shift_runtime.service.core import Core, Recall
from shift_schemas.messages import AoiPositions, Fact, GazeChunk
from shift_schemas.registry import READS

from shift_monitor import core
from shift_monitor.area_step import positions_input
from shift_monitor.core import MonitorState
from shift_monitor.gaze_input import ChunkWithHistory, gaze_input
from shift_monitor.state import may_be_moved_again, may_be_used


def prepared(state: MonitorState | None, message: Any, recall: Recall) -> Any:
    """Return gaze or moving AOIs together with what was recorded under their number, if the number may be used."""
    if isinstance(message, AoiPositions):
        return positions_input(message, recall if may_be_moved_again(state, message) else _nothing)
    if not isinstance(message, GazeChunk):
        return message
    return gaze_input(message, recall) if may_be_used(state, message) else ChunkWithHistory(message)


def _nothing(subject: str, **fields: object) -> tuple[Fact, ...]:
    """Recall nothing: no message of this number was recorded."""
    return ()


CORE: Core[MonitorState] = Core(
    name="monitor",
    step=core.step,
    dump=core.dump,
    load=core.load,
    reads=READS["monitor"],
    prepare=prepared,
    held=core.held,
    refused=core.refused,
    lookups={"gaze": ("source", "seq"), "aois": ("source", "seq")},
)
