"""Boxes that move at 30 Hz under real gaze at 300 Hz: the weights are those of a program that looks at each sample."""

from __future__ import annotations

from pathlib import Path

import httpx
import pytest
from shift_monitor.attention import initial_attention
from shift_monitor.gaze_stream import GazeStream
from shift_monitor.prepared_study import PreparedStudy, prepare_study
from shift_recording.mcap.reader import facts
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import Conflict, MalformedMessage
from shift_schemas.messages import AoiPositions, Aois, Fixation, GazeChunk
from shift_schemas.timestamps import NS
from shift_sources.files.formats import read_samples
from shift_sources.files.samples import Sample, chunks
from shift_study.area_geometry import Area
from shift_study.loading import given_study, study_json
from shift_study.moving_areas import AreasOverTime, Layout
from shift_verify.verify import verify
from support import slow_gaze
from support.whole_mesh import LiveMesh

TRIAL = Path(__file__).parents[1] / "data" / "gaze" / "tx300-p1-trial1.tsv.gz"
STUDY = {
    "study": "moving",
    "aois": [
        {"name": "cup", "rectangle": [0.3, 0.3, 0.5, 0.7]},
        {"name": "robot", "polygon": [[0.0, 0.0], [0.4, 0.0], [0.2, 1.0]]},
        {"name": "table", "rectangle": [0.0, 0.0, 1.0, 1.0]},
    ],
}


def box(t: float) -> list[float]:
    """Return where the cup is: it goes to and fro in two seconds."""
    left = 0.2 + 0.4 * abs((t % 2.0) - 1.0)
    return [left, 0.2, left + 0.25, 0.8]


def moves(samples: list[Sample]) -> list[AoiPositions]:
    """Return the messages; the robot is away for some time."""
    found = []
    for seq in range(int(samples[-1].t * 30)):
        aois: list[dict[str, object]] = [{"name": "cup", "rectangle": box(seq / 30)}]
        if seq in (60, 120):
            aois.append({"name": "robot", "visible": seq == 120})
        found.append(AoiPositions.model_validate({"source": "tx", "seq": seq, "t": seq / 30, "aois": aois}))
    return found


def naive(samples: list[Sample], prepared: PreparedStudy) -> tuple[float, ...]:
    """Return the weights of the program that looks at each sample on its own, and that knows all places before."""
    layouts, robot = [], prepared.areas[1]
    for seq in range(int(samples[-1].t * 30)):
        robot = Area(0.0, 0.0, 0.0, 0.0) if 60 <= seq < 120 else prepared.areas[1]
        layouts.append(Layout(round(seq / 30 * NS), (Area(*box(seq / 30)), robot, prepared.areas[2])))
    areas = AreasOverTime(prepared.areas, tuple(layouts))
    whole = next(chunks(samples, len(samples), "tx"))
    times = [round(t * NS) for t in whole.t]
    _, attention, _ = slow_gaze.apply_points(
        GazeStream("tx"), initial_attention(3), times, whole, prepared, areas
    )  # fmt: skip
    return attention.weights


def test_hits_are_those_of_a_naive_program_and_verify_derives_them(mesh: LiveMesh) -> None:
    samples = list(read_samples(TRIAL))
    waiting = moves(samples)
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="moving", study=STUDY)
        for chunk in chunks(samples, 30, "tx"):
            while waiting and waiting[0].t <= chunk.t[-1]:
                assert "warnings" not in shift.aois("moving", waiting.pop(0))
            shift.gaze("moving", chunk)
            if chunk.seq == 20:
                mesh.kill("shift_monitor")
                mesh.wait_ready()
        assert shift.aois("moving", moves(samples)[3]) == {"accepted": 1}, "a repeat counts once"
        seen = shift.observation("moving")["gaze"]
        shift.end("moving")
    prepared = prepare_study(study_json(given_study(STUDY)))
    assert list(seen["weights"].values()) == pytest.approx(naive(samples, prepared), abs=1e-9)
    assert seen["weights"] != pytest.approx(dict.fromkeys(seen["weights"], 1 / 3))
    path = mesh.data / "recordings" / "moving.mcap"
    report = verify(path)
    assert report.ok, report.difference
    recorded = [r.fact for r in facts(path)]
    assert [f.seq for f in recorded if isinstance(f, Aois)] == [m.seq for m in moves(samples)]
    fixations = [f for f in recorded if isinstance(f, Fixation)]
    assert {"cup", "robot", "table"} >= {f.aoi for f in fixations} - {""}
    assert any(len(f.aois or ()) > 1 for f in fixations), "areas overlap"
    assert all((f.aois or [""])[0] == f.aoi for f in fixations)


def test_gateway_refuses_areas_with_field_and_rule(mesh: LiveMesh) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="refused", study=STUDY)
        wrong = AoiPositions.model_validate(
            {"source": "tx", "seq": 0, "t": 0.0, "aois": [{"name": "cop", "visible": False}]}
        )
        with pytest.raises(MalformedMessage, match="did you mean 'cup'"):
            shift.aois("refused", wrong)
        answer = httpx.post(f"{mesh.url}/v1/sessions/refused/aois", json={"source": "tx", "seq": 0, "t": 0, "aois": []})
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == "aois"
        for source in ("tx", "spare"):
            shift.gaze("refused", GazeChunk(source=source, seq=0, t=[0.0], x=[0.5], y=[0.5]))
        with pytest.raises(Conflict, match="was replaced by spare"):
            shift.aois("refused", wrong.model_copy(update={"aois": moves([Sample(1.0, 0, 0, True)])[0].aois}))
        shift.end("refused")
