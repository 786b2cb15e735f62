"""Exports: every value as it was recorded, to the last digit; damaged and excluded recordings are reported."""

from __future__ import annotations

import csv
import gzip
import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
import shift_recording
import vowpalwabbit
from shift_recording.exclusion import ExclusionEntry, add_entry
from shift_recording.export.export import Exported, export
from shift_recording.export.screen import Screen
from shift_recording.mcap.reader import facts
from shift_schemas.errors import DamagedRecording, InvalidSettings, MalformedMessage, UnknownThing
from shift_schemas.messages import Decision, Gaze, Performance
from shift_schemas.timestamps import Stamp
from shift_verify.verify import verify
from support.verify_sessions import Session

TABLES = ("sessions", "gaze", "fixations", "observations", "estimates", "decisions", "performances", "transitions",
          "markers", "overrides", "clocks", "aois")  # fmt: skip
SCREEN = Screen(1920, 1080)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recording of a session with gaze, decisions, overrides, markers and changes of the configuration."""
    return Session(seed=3).interactions(30).ended().finished(tmp_path_factory.mktemp("recording"))


@pytest.fixture(scope="module")
def covariates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("people") / "people.csv"
    path.write_text("participant,age,group\nP01,34,A\nP02,28,B\n", encoding="utf-8")
    return path


def test_covariates_of_the_start_are_columns_and_the_file_stands_in_their_place(tmp_path: Path) -> None:
    given = {"age": "31", "handedness": "left"}
    path = Session(seed=4, covariates=given).interactions(3).ended().finished(tmp_path)
    assert verify(path).ok
    (row,) = read_csv(export([path], "csv", tmp_path / "a").files[0].parent / "sessions.csv")
    assert (row["age"], row["handedness"]) == ("31", "left")
    people = tmp_path / "people.csv"
    people.write_text("participant,age\nP01,32\n", encoding="utf-8")
    export([path], "csv", tmp_path / "b", covariates=people)
    (row,) = read_csv(tmp_path / "b" / "sessions.csv")
    assert (row["age"], row["handedness"]) == ("32", "left")
    export([path], "bids", tmp_path / "c", screen=SCREEN)
    assert "31\tleft" in (tmp_path / "c" / "participants.tsv").read_text()


def read_csv(path: Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def recorded(recording: Path, subject: str) -> list[Any]:
    return [found.fact for found in facts(recording) if found.fact.subject == subject]


@pytest.fixture(scope="module")
def tables(recording: Path, covariates: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Exported]:
    out = tmp_path_factory.mktemp("csv")
    return out, export([recording], "csv", out, covariates=covariates)


def test_each_table_has_a_row_for_each_fact(recording: Path, tables: tuple[Path, Exported]) -> None:
    out, done = tables
    assert sorted(path.name for path in done.files) == sorted([*(f"{t}.csv" for t in TABLES), "data-dictionary.csv"])
    for table in TABLES:
        subject = table if table in ("gaze", "aois") else table.removesuffix("s")
        found = recorded(recording, subject)
        wanted = 1 if table == "sessions" else len(found)
        if table == "gaze":
            wanted = sum(len(fact.t) for fact in found)
        assert len(read_csv(out / f"{table}.csv")) == done.rows[table] == wanted > 0, table


def test_gaze_has_the_samples_to_the_last_digit(recording: Path, tables: tuple[Path, Exported]) -> None:
    rows = read_csv(tables[0] / "gaze.csv")
    samples = [(fact, i) for fact in recorded(recording, "gaze") for i in range(len(fact.t))]
    for row, (fact, i) in zip(rows, samples, strict=True):
        assert isinstance(fact, Gaze)
        assert (row["source"], int(row["seq"]), int(row["sample"])) == (fact.source, fact.seq, i)
        assert float(row["t_s"]) == fact.t[i]
        assert row["valid"] == str(fact.valid[i]).lower()
        assert (row["x"] and float(row["x"])) == (fact.x[i] if fact.valid[i] else "")


def test_gaze_stands_on_session_time(recording: Path, tables: tuple[Path, Exported]) -> None:
    started = recorded(recording, "session")[0].started.ns
    last = recorded(recording, "gaze")[-1]
    row = read_csv(tables[0] / "gaze.csv")[-1]
    assert float(row["session_s"]) == pytest.approx((last.stamp.ns - started) / 1e9)


def test_decision_has_what_a_mixed_model_needs(recording: Path, tables: tuple[Path, Exported]) -> None:
    observations = {o.version: o for o in recorded(recording, "observation")}
    performances = {p.decision_id: p for p in recorded(recording, "performance")}
    rows = read_csv(tables[0] / "decisions.csv")
    for row, decision in zip(rows, recorded(recording, "decision"), strict=True):
        assert isinstance(decision, Decision)
        seen, result = observations[decision.versions.observation], performances[decision.decision_id]
        assert isinstance(result, Performance)
        assert float(row["capacity_value"]) == seen.capacity.value
        assert {n: float(row[f"weights_{n}"]) for n in seen.gaze.weights} == seen.gaze.weights
        assert float(row["lost"]) == seen.gaze.lost
        assert [float(row[f"probability_{n}"]) for n in range(1, 7)] == decision.probabilities
        assert {n: row[f"strategy_{n}"] for n in decision.strategy} == decision.strategy
        assert decision.actions[int(row["action"]) - 1] == decision.strategy
        assert float(row["reward"]) == result.reward
        assert row["comprehension_success"] == str(result.comprehension.success).lower()
        assert row["stamp_utc"] == iso(decision.stamp)


def iso(stamp: Stamp) -> str:
    return pd.Timestamp(stamp.ns, tz="UTC").strftime("%Y-%m-%dT%H:%M:%S.%f") + f"{stamp.nsec % 1000:03}Z"


def test_session_has_covariates_and_its_state(tables: tuple[Path, Exported]) -> None:
    (row,) = read_csv(tables[0] / "sessions.csv")
    assert (row["session"], row["participant"], row["age"], row["group"]) == ("s1", "P01", "34", "A")
    assert (row["state"], row["complete"], row["file"]) == ("ended", "true", "s1.mcap")
    assert float(row["duration_s"]) > 0


def test_dictionary_explains_every_column(tables: tuple[Path, Exported]) -> None:
    explained = {(row["table"], row["column"]): row for row in read_csv(tables[0] / "data-dictionary.csv")}
    for table in TABLES:
        header = (tables[0] / f"{table}.csv").read_text(encoding="utf-8").split("\n", 1)[0]
        for column in header.replace('"', "").split(","):
            assert (table, column) in explained
    assert explained["gaze", "t_s"]["unit"] == "s"
    assert explained["decisions", "propensity"]["meaning"] != ""


def test_parquet_has_the_same_values_and_real_times(
    recording: Path, tables: tuple[Path, Exported], tmp_path: Path
) -> None:
    done = export([recording], "parquet", tmp_path)
    assert done.rows == tables[1].rows
    for table in TABLES:
        whole = pq.read_table(tmp_path / f"{table}.parquet").to_pandas()
        text = pd.read_csv(tables[0] / f"{table}.csv", dtype=str, keep_default_na=False)
        for column in whole.select_dtypes("number"):
            assert [("" if pd.isna(v) else float(v)) for v in whole[column]] == [v and float(v) for v in text[column]]
    decisions = pq.read_table(tmp_path / "decisions.parquet").to_pandas()
    assert [t.value for t in decisions["stamp_utc"]] == [d.stamp.ns for d in recorded(recording, "decision")]


def test_frames_are_two_lines_of_python(recording: Path) -> None:
    found = shift_recording.frames(recording)
    assert list(found.decisions["decision_id"]) == [d.decision_id for d in recorded(recording, "decision")]
    assert set(found) == set(TABLES)
    with pytest.raises(AttributeError, match="there is no table 'desicions'; there are sessions"):
        found.desicions  # noqa: B018


def test_frames_of_a_damaged_recording_are_refused(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(DamagedRecording):
        shift_recording.frames(damaged(recording, tmp_path))


def damaged(recording: Path, folder: Path) -> Path:
    """Return a copy with a flipped bit in the middle."""
    content = bytearray(recording.read_bytes())
    content[len(content) // 2] ^= 1
    path = folder / "damaged.mcap"
    path.write_bytes(content)
    return path


# --- several recordings ---


def other_session(folder: Path) -> Path:
    """Return the recording of another session, with other AOIs."""
    study = {"aois": [{"name": "cup", "rectangle": [0, 0, 0.5, 1]}, {"name": "robot", "rectangle": [0.5, 0, 1, 1]}]}
    return Session(study, seed=5).interactions(4).ended().finished(folder)


def test_two_recordings_of_one_session_are_refused(recording: Path, tmp_path: Path) -> None:
    other = other_session(tmp_path)
    with pytest.raises(MalformedMessage, match="are both recordings of session s1"):
        export([recording, other], "csv", tmp_path / "out")


def test_damaged_recording_is_reported_and_the_others_go_on(recording: Path, tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "whole.mcap").write_bytes(recording.read_bytes())
    (folder / "nothing.mcap").write_bytes(b"not a recording")
    done = export([folder], "csv", tmp_path / "out")
    assert list(done.report.damaged) == ["nothing.mcap"]
    assert done.rows["decisions"] == 30


def test_unfinished_recording_is_exported_as_far_as_it_goes(tmp_path: Path) -> None:
    segment = Session(seed=4).interactions(5).segment(tmp_path)
    export([segment], "csv", tmp_path / "out")
    (row,) = read_csv(tmp_path / "out" / "sessions.csv")
    assert (row["complete"], row["state"], row["duration_s"]) == ("false", "live", "")
    assert row["incomplete_reason"] != ""


def test_excluded_recording_is_left_out_unless_it_is_asked_for(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "s1.mcap"
    copy.write_bytes(recording.read_bytes())
    add_entry(copy, ExclusionEntry(excluded=True, reason="fire alarm", author="Ada", time=Stamp.of(1)))
    left_out = export([copy], "csv", tmp_path / "out")
    assert (left_out.report.excluded, left_out.rows["decisions"]) == ({"s1.mcap": "fire alarm"}, 0)
    assert export([copy], "csv", tmp_path / "out", with_excluded=True).rows["decisions"] == 30


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("person,age\nP01,3\n", "one of them is participant"), ("participant,age\nP01,3\nP01,4\n", "line 3.*twice"),
    ],
)  # fmt: skip
def test_mistake_in_the_covariates_is_named(recording: Path, tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "people.csv"
    path.write_text(text)
    with pytest.raises(MalformedMessage, match=said):
        export([recording], "csv", tmp_path / "out", covariates=path)


def test_empty_folder_and_missing_file_are_named(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing, match="has no recording"):
        export([tmp_path], "csv", tmp_path / "out")
    with pytest.raises(UnknownThing, match="there is no file"):
        export([tmp_path / "s9.mcap"], "csv", tmp_path / "out")


def test_nothing_is_left_of_an_export_that_fails(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise OSError("no room")

    monkeypatch.setattr("shift_recording.export.arrow_tables.batch_of", fails)
    with pytest.raises(OSError, match="no room"):
        export([recording], "csv", tmp_path)
    assert list(tmp_path.iterdir()) == []


# --- BIDS and Vowpal Wabbit ---


@pytest.fixture(scope="module")
def bids(recording: Path, covariates: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bids") / "set"
    export([recording], "bids", out, covariates=covariates, screen=SCREEN)
    return out


def test_bids_validator_finds_no_error(bids: Path) -> None:
    validator = Path(sys.executable).with_name("bids-validator-deno")
    line = [str(validator), str(bids), "--json"]
    done = subprocess.run(line, capture_output=True, text=True, timeout=120, check=False)
    issues = json.loads(done.stdout)["issues"]["issues"]
    assert [issue for issue in issues if issue.get("severity") == "error"] == []


def test_bids_has_the_two_entries_that_the_validator_misses(bids: Path) -> None:
    physio = list(bids.rglob("*_physio.tsv.gz"))
    assert physio
    assert all("_recording-eye" in path.name for path in physio)
    for path in bids.rglob("*_events.json"):
        presentation = json.loads(path.read_text())["StimulusPresentation"]
        assert presentation["ScreenSize"] == [0.509, 0.286]
        assert presentation["ScreenResolution"] == [1920, 1080]
        assert presentation["ScreenDistance"] == 0.65


def test_bids_gaze_is_in_pixels_without_a_header(bids: Path, recording: Path) -> None:
    first = recorded(recording, "gaze")[0]
    path = next(bids.rglob("*recording-eye1_physio.tsv.gz"))
    with gzip.open(path, "rt") as stream:
        rows = [line.rstrip("\n").split("\t") for line in stream]
    described = json.loads(path.with_name(path.name.replace(".tsv.gz", ".json")).read_text())
    assert described["Columns"] == ["timestamp", "x_coordinate", "y_coordinate", "session_time"]
    assert described["SamplingFrequency"] == pytest.approx(60.0)
    assert float(rows[0][0]) == first.t[0]
    assert rows[0][1] == (str(first.x[0] * 1920) if first.valid[0] else "n/a")


def test_bids_events_have_every_decision_performance_and_marker(bids: Path, recording: Path) -> None:
    with open(next(bids.rglob("*_events.tsv"))) as stream:
        rows = list(csv.DictReader(stream, delimiter="\t"))
    for kind in ("decision", "performance", "marker"):
        assert sum(row["trial_type"] == kind for row in rows) == len(recorded(recording, kind))
    onsets = [float(row["onset"]) for row in rows]
    assert onsets == sorted(onsets)


def test_bids_export_is_the_same_byte_for_byte(bids: Path, recording: Path, covariates: Path, tmp_path: Path) -> None:
    export([recording], "bids", tmp_path, covariates=covariates, screen=SCREEN)

    def digests(folder: Path) -> dict[str, str]:
        files = (path for path in folder.rglob("*") if path.is_file())
        return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}

    assert digests(tmp_path) == digests(bids)


def test_bids_needs_the_size_of_the_screen(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidSettings, match="--screen 1920x1080"):
        export([recording], "bids", tmp_path)


def test_vowpal_wabbit_reads_the_lines_back(recording: Path, tmp_path: Path) -> None:
    done = export([recording], "vw", tmp_path)
    lines = (tmp_path / "decisions.vw").read_text().splitlines()
    decisions = [d for d in recorded(recording, "decision") if d.propensity is not None]
    rewards = {p.decision_id: p.reward for p in recorded(recording, "performance")}
    assert len(lines) == len(decisions) == done.rows["decisions"]
    workspace = vowpalwabbit.Workspace("--cb 6 --quiet")
    for line, decision in zip(lines, decisions, strict=True):
        example = workspace.example(line)
        label = example.get_label(vowpalwabbit.LabelType.CONTEXTUAL_BANDIT)
        (cost,) = label.costs
        assert cost.action == decision.actions.index(decision.strategy) + 1
        assert cost.cost == pytest.approx(-rewards[decision.decision_id], abs=1e-6)
        assert cost.probability == pytest.approx(decision.propensity, abs=1e-6)
        workspace.finish_example(example)
    workspace.finish()
