"""``shift-mesh source lsl`` with real streams of Lab Streaming Layer on this computer."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from shift_recording.mcap.reader import facts
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import Clock, Gaze, Marker
from shift_verify.verify import verify
from support.lsl_streams import environment, number_of, outlet
from support.whole_mesh import LiveMesh


@contextmanager
def source(mesh: LiveMesh, folder: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """Run the command; end it as Ctrl-C does."""
    line = [sys.executable, "-m", "shift_cli.main", "source", *words, "--url", mesh.url]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(folder))
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def stopped(process: subprocess.Popen[str]) -> str:
    """Stop the command with Ctrl-C; return what it said."""
    process.send_signal(signal.SIGINT)
    return process.communicate(timeout=40)[1]


def wait_for_end(*outlets: subprocess.Popen[str]) -> None:
    """Wait until each outlet says that it has sent everything, and a moment for what is on its way."""
    for each in outlets:
        assert each.stdout is not None
        assert each.stdout.readline()
    time.sleep(1.0)


def recorded(mesh: LiveMesh, session: str) -> list[Any]:
    path = mesh.data / "recordings" / f"{session}.mcap"
    report = verify(path)
    assert report.ok, report.difference
    return [each.fact for each in facts(path)]


def test_every_sample_is_recorded_in_order_over_restarts_and_steps_of_the_clock(mesh: LiveMesh, tmp_path: Path) -> None:
    count = 2400
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="lsl")
        with source(mesh, tmp_path, "lsl", "--session", "lsl") as process:
            for first in (0, count, 2 * count):
                step = ("--step", "10", "--step-at", str(count // 2)) if first == count else ()
                words = ("--rate", "1200", "--count", str(count), "--first", str(first), *step)
                with outlet(tmp_path, "gaze", *words, "--lost", "100") as stream:
                    assert stream.stdout is not None
                    assert json.loads(stream.stdout.readline())["last"] == first + count - 1
                    time.sleep(0.5)
            said = stopped(process)
            assert f"{3 * count} samples, {3 * count} kept" in said
            assert process.returncode == 0
        shift.end("lsl")
    found = recorded(mesh, "lsl")
    gaze = [fact for fact in found if isinstance(fact, Gaze)]
    points = [p for f in gaze for p in zip(f.x, f.y, f.valid, strict=True)]
    assert len(points) == 3 * count
    assert [number_of(x, y) for x, y, valid in points if valid] == [i for i in range(3 * count) if i % count % 100]
    clock = [fact for fact in found if isinstance(fact, Clock)][-1]
    assert (clock.samples, clock.missing, clock.restarts) == (3 * count, 0, 2)
    steps = [segment.step_s for segment in clock.segments or ()]
    assert steps == pytest.approx([0.0, 10.0, -10.0], abs=0.1)
    assert clock.round_trip_s is not None
    assert clock.round_trip_s < 0.1


def test_stream_without_a_source_id_and_the_mesh_come_back(mesh: LiveMesh, tmp_path: Path) -> None:
    with RestClient(mesh.url, patience_s=60) as shift:
        shift.start("P01", session="anonymous")
        with source(mesh, tmp_path, "lsl", "--session", "anonymous") as process:
            for first in (0, 900):
                words = ("--rate", "300", "--count", "900", "--first", str(first), "--source-id", "")
                with outlet(tmp_path, "gaze", *words) as stream:
                    time.sleep(1.5)
                    mesh.kill("shift_gateway" if first else "shift_monitor")
                    assert stream.stdout is not None
                    assert json.loads(stream.stdout.readline())["first"] == first
                    time.sleep(0.5)
            mesh.wait_ready()
            said = stopped(process)
        assert "1800 samples, 1800 kept; connected again 1 times" in said
        assert said.count("the stream is lost") <= 2
        shift.end("anonymous")
    points = [p for f in recorded(mesh, "anonymous") if isinstance(f, Gaze) for p in zip(f.x, f.y, strict=True)]
    assert [number_of(x, y) for x, y in points] == list(range(1800))


def test_names_markers_and_the_list_of_streams(mesh: LiveMesh, tmp_path: Path) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="named", study={"study": "s", "aois": [{"name": "cup", "rectangle": [0, 0, 1, 1]}]})
        words = ("gaze", "--rate", "100", "--count", "400")
        with (
            outlet(tmp_path, *words) as eyes,
            outlet(tmp_path, "texts", "light on", "light off", "--name", "Events", "--source-id", "events") as events,
            source(mesh, tmp_path, "lsl", "--list") as listing,
        ):
            lines = listing.communicate(timeout=30)[0]
            assert "'Eyes', type Gaze, 4 channels, 100 Hz" in lines
            assert "'Events', type Markers" in lines
            options = ("--aoi", "--aoi-map", "1=cup", "--aoi-map", "0=", "--markers", "Events")
            with source(mesh, tmp_path, "lsl", "--session", "named", *options) as process:
                wait_for_end(eyes, events)
                assert "2 markers" in stopped(process)
        shift.end("named")
    found = recorded(mesh, "named")
    names = [name for fact in found if isinstance(fact, Gaze) for name in fact.aoi]
    assert names == [""] * 100 + ["cup"] * 100 + [""] * 100 + ["cup"] * 100
    assert [fact.text for fact in found if isinstance(fact, Marker)] == ["light on", "light off"]


def test_aoi_names_of_a_stream_of_texts_are_said_again(mesh: LiveMesh, tmp_path: Path) -> None:
    aois = [{"name": "cup", "rectangle": [0, 0, 0.5, 1]}, {"name": "pot", "rectangle": [0.5, 0, 1, 1]}]
    study = {"study": "s", "aois": aois}
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="texts", study=study)
        with (
            outlet(
                tmp_path, "texts", "cup", "pot", "--name", "Looks", "--source-id", "looks", "--pause", "2.2"
            ) as looks,
            source(mesh, tmp_path, "lsl", "--session", "texts", "--aoi-stream", "Looks") as process,
        ):
            wait_for_end(looks)
            stopped(process)
        gaze = shift.observation("texts")["gaze"]
        shift.end("texts")
    assert gaze["aoi"] == "pot"
    assert gaze["lost"] < 0.1, "a name counts for a second, and is said again before"
    times = [t for fact in recorded(mesh, "texts") if isinstance(fact, Gaze) for t in fact.t]
    assert times == sorted(times)
    assert len(times) > 10


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--session", "nobody"), "there is no session nobody"),
        ((), "say which session gets the gaze"),
        (("--session", "wrong", "--name", "Nose"), "there is no stream named 'Nose'; the streams there are: "),
        (("--session", "wrong", "--unit", "cm"), "--unit is 'cm'; there are normalised, pixels"),
    ],
)
def test_wrong_use_is_said_in_a_sentence(mesh: LiveMesh, tmp_path: Path, words: tuple[str, ...], reason: str) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="wrong")
        with source(mesh, tmp_path, "lsl", *words) as process:
            said = process.communicate(timeout=30)[1]
    assert reason in said
    assert process.returncode == 2


def test_outlet_publishes_decisions_states_and_rewards(mesh: LiveMesh, tmp_path: Path) -> None:
    script = """
import json, sys, pylsl
(info,) = pylsl.resolve_byprop("name", "SHIFT out", 1, 20)
inlet = pylsl.StreamInlet(info)
inlet.open_stream(10)
print("open", flush=True)
while True:
    row, t = inlet.pull_sample(20)
    print(row[0], flush=True)
    if json.loads(row[0])["event"] == "end":
        break
"""
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="out")
        with source(mesh, tmp_path, "lsl-outlet", "--session", "out") as process:
            reader = subprocess.Popen(
                [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=environment(tmp_path)
            )
            assert reader.stdout is not None
            assert reader.stdout.readline() == "open\n"
            decision = shift.decide("out", "grasp")
            report = shift.report("out", decision["decision_id"], True, 5.0, False, 6.0)
            shift.end("out")
            lines = [json.loads(line) for line in reader.communicate(timeout=40)[0].splitlines()]
            assert process.wait(20) == 0
    by_event = {line["event"]: line for line in lines}
    assert by_event["decision"]["strategy"] == decision["strategy"]
    assert by_event["decision"]["cognitive_state"] == decision["cognitive_state"]
    assert by_event["reward"]["reward"] == report["reward"]
    assert by_event["end"] == {"event": "end", "session": "out"}


def test_doctor_finds_the_stream_and_says_how_to_connect_it(mesh: LiveMesh, tmp_path: Path) -> None:
    words = ("--url", mesh.url, "--zenoh", mesh.zenoh)
    with outlet(tmp_path, "gaze", "--name", "My eyes"):
        time.sleep(1)
        line = [sys.executable, "-m", "shift_cli.main", "doctor", *words]
        done = subprocess.run(line, capture_output=True, text=True, env=environment(tmp_path), timeout=60)
        found = subprocess.run([*line, "--json"], capture_output=True, text=True, env=environment(tmp_path), timeout=60)
    assert "connect it with: shift-mesh source lsl --session S --name 'My eyes'" in done.stdout
    (source_,) = json.loads(found.stdout)["sources"]
    assert source_["what"].startswith("Lab Streaming Layer: 'My eyes', type Gaze")
    assert done.returncode == 0
