"""What was lost on the way is in the recording: repeated, refused, late and missing chunks of each source."""

from __future__ import annotations

import contextlib

from shift_recording.mcap.reader import facts
from shift_recording.summary import info_of
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Clock, GazeChunk
from shift_verify.verify import verify
from support.whole_mesh import LiveMesh


def chunk(seq: int, source: str = "tx", aoi: str = "left") -> GazeChunk:
    return GazeChunk(source=source, seq=seq, t=[seq + i / 10 for i in range(5)], aoi=[aoi] * 5)


def test_losses_survive_a_kill_and_are_recorded_by_source_and_reason(mesh: LiveMesh) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="losses")
        for seq in (0, 1, 1, 4, 2, 4):
            shift.gaze("losses", chunk(seq))
        for _ in range(3):
            with contextlib.suppress(MalformedMessage):
                shift.gaze("losses", chunk(9, aoi="nowhere"))
        shift.observation("losses")
        shift.decide("losses", "grasp")
        mesh.kill("shift_monitor")
        mesh.wait_ready()
        shift.gaze("losses", chunk(5))
        shift.gaze("losses", chunk(0, "spare"))
        shift.end("losses")
    path = mesh.data / "recordings" / "losses.mcap"
    assert verify(path).ok
    found = {r.fact.source: r.fact for r in facts(path) if isinstance(r.fact, Clock)}
    assert list(found) == ["tx", "spare"]
    tx = found["tx"]
    assert (tx.chunks, tx.samples, tx.late, tx.missing, tx.repeated) == (4, 20, 1, 1, 2)
    assert tx.refused == {"malformed": 3}
    assert (found["spare"].chunks, found["spare"].repeated, found["spare"].refused) == (1, 0, {})
    assert [clock["source"] for clock in info_of(path).clocks] == ["tx", "spare"]
