"""A BIDS data set (version 1.11) from recordings: eye tracking as ``physio``, fixations, and the events of the session.

https://bids-specification.readthedocs.io/en/v1.11.0/modality-specific-files/physiological-recordings.html
"""

from __future__ import annotations

import gzip
import json
import re
import statistics
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from shift_study.study import Study

from shift_recording.durable_file import write_durably
from shift_recording.export.screen import Screen
from shift_recording.export.tables import Row

VERSION = "1.11.0"
PHYSIO = {
    "timestamp": ("s", "Time on the clock of the gaze source."),
    "x_coordinate": ("pixel", "Gaze position from the left edge of the screen."),
    "y_coordinate": ("pixel", "Gaze position from the top edge of the screen."),
    "session_time": ("s", "Time since the session's start, by the clock of the mesh."),
}
FIXATIONS = {
    "onset": ("s", "Start of the fixation on the clock of the gaze source."),
    "duration": ("s", "Duration of the fixation."),
    "trial_type": ("", "fixation"),
    "x_coordinate": ("pixel", "Mean gaze position from the left edge of the screen."),
    "y_coordinate": ("pixel", "Mean gaze position from the top edge of the screen."),
    "aoi": ("", "The area of interest at the mean position."),
}
EVENTS = {
    "onset": ("s", "Time since the session's start."),
    "duration": ("s", "Duration of the event; n/a for an event without one."),
    "trial_type": ("", "decision, performance or marker."),
    "decision_id": ("", "The decision."),
    "task": ("", "The task that was explained."),
    "strategy": ("", "The strategy, one level of each."),
    "cognitive_state": ("", "The cognitive state."),
    "propensity": ("", "Probability of the chosen strategy; n/a for an override."),
    "reward": ("", "The reward of the performance."),
    "text": ("", "The marker's text."),
}
GZIP_LEVEL = 2
"""Measured with gaze at 300 Hz: 20 times as fast as Python's own choice of 9, and files 14 % larger."""
MOST_INTERVALS = 10_000
"""The sampling frequency is that of the median of so many intervals at most."""
_NOT_IN_LABEL = re.compile(r"[^0-9a-zA-Z]")


@dataclass
class Labels:
    """BIDS labels of ids: letters and digits alone. Two ids never have the same label."""

    _labels: dict[str, str] = field(default_factory=dict)

    def of(self, name: str) -> str:
        """Return the label of an id."""
        if name not in self._labels:
            label = plain = _NOT_IN_LABEL.sub("", name) or "x"
            number = 1
            while label.lower() in (other.lower() for other in self._labels.values()):
                number += 1
                label = f"{plain}x{number}"
            self._labels[name] = label
        return self._labels[name]


class GazeFile:
    """The physio file of one gaze source in one session."""

    def __init__(self, stem: Path, screen: Screen) -> None:
        self.stem, self._screen = stem, screen
        self.samples = 0
        self._previous: tuple[int, float] | None = None
        self._intervals: list[float] = []
        self._start_s: float | None = None
        self._raw = open(stem.with_name(f"{stem.name}_physio.tsv.gz"), "wb")  # noqa: SIM115 (closed by close)
        self._file = gzip.GzipFile("", "wb", GZIP_LEVEL, fileobj=self._raw, mtime=0)

    def add(self, rows: pa.Table) -> None:
        """Append samples: rows of the table ``gaze``."""
        if self._start_s is None:
            self._start_s = rows["session_s"][0].as_py()
        self._add_intervals(rows)
        pixels = [pc.multiply(rows["x"], float(self._screen.width)), pc.multiply(rows["y"], float(self._screen.height))]
        columns = [rows["t_s"], *pixels, rows["session_s"]]
        texts = [pc.fill_null(column.cast(pa.string()), "n/a") for column in columns]
        pyarrow.csv.write_csv(
            pa.table(texts, names=list(PHYSIO)),
            self._file,
            pyarrow.csv.WriteOptions(include_header=False, delimiter="\t", quoting_style="none"),
        )
        self.samples += rows.num_rows

    def _add_intervals(self, rows: pa.Table) -> None:
        for segment, t in zip(rows["segment"].to_pylist(), rows["t_s"].to_pylist(), strict=True):
            if len(self._intervals) == MOST_INTERVALS:
                return
            if self._previous is not None and self._previous[0] == segment:
                self._intervals.append(t - self._previous[1])
            self._previous = segment, t

    def close(self, source: str) -> None:
        """Finish the file and write what describes it."""
        self._file.close()
        self._raw.close()
        rising = [interval for interval in self._intervals if interval > 0]
        described = {
            "SamplingFrequency": round(1 / statistics.median(rising), 6) if rising else 0.0,
            "StartTime": self._start_s or 0.0,
            "Columns": list(PHYSIO),
            "PhysioType": "eyetrack",
            "RecordedEye": "cyclopean",
            "SampleCoordinateSystem": "gaze-on-screen",
            "SourceName": source,
            **_described(PHYSIO),
        }
        _write_json(self.stem.with_name(f"{self.stem.name}_physio.json"), described)


class BidsSession:
    """The folder of one session."""

    def __init__(self, folder: Path, stem: str, screen: Screen) -> None:
        self.folder, self._stem, self._screen = folder, stem, screen
        self._gaze: dict[str, GazeFile] = {}
        self._fixations: dict[str, list[Row]] = {}
        self._events: list[Row] = []
        folder.mkdir(parents=True, exist_ok=True)

    def add_gaze(self, rows: pa.Table) -> None:
        """Add rows of the table ``gaze``; gaze on AOIs has no coordinates and is not part of BIDS."""
        points = rows.filter(pc.is_valid(rows["valid"]))
        for source in pc.unique(points["source"]).to_pylist():
            if source not in self._gaze:
                self._gaze[source] = GazeFile(self._recording(len(self._gaze) + 1), self._screen)
            self._gaze[source].add(points.filter(pc.equal(points["source"], source)))

    def add(self, table: str, row: Row) -> None:
        """Add a row of one of the other tables; rows of tables that BIDS does not have are left out."""
        if table == "fixations":
            self._fixations.setdefault(row["source"], []).append(row)
        elif table in ("decisions", "performances", "markers"):
            self._events.append(event_of(table, row))

    def close(self, study: Study | None) -> int:
        """Write the rest; return how many samples there are."""
        for source, file in self._gaze.items():
            file.close(source)
            self._write_fixations(file.stem, self._fixations.get(source, []))
        name = f"{self._stem}_events"
        rows = sorted(self._events, key=lambda row: row["onset"])
        lines = [_line(EVENTS), *(_line(row.get(column) for column in EVENTS) for row in rows)]
        write_durably(self.folder / f"{name}.tsv", b"".join(lines))
        presentation = {"StimulusPresentation": stimulus_presentation(study, self._screen)} if study else {}
        _write_json(self.folder / f"{name}.json", {**_described(EVENTS), **presentation})
        return sum(file.samples for file in self._gaze.values())

    def _recording(self, number: int) -> Path:
        return self.folder / f"{self._stem}_recording-eye{number}"

    def _write_fixations(self, stem: Path, rows: list[Row]) -> None:
        if not rows:
            return
        with (
            open(stem.with_name(f"{stem.name}_physioevents.tsv.gz"), "wb") as raw,
            gzip.GzipFile("", "wb", GZIP_LEVEL, fileobj=raw, mtime=0) as file,
        ):
            for row in sorted(rows, key=lambda row: (row["segment"], row["start_s"])):
                x, y = row["x"] * self._screen.width, row["y"] * self._screen.height
                file.write(_line((row["start_s"], row["duration_s"], "fixation", x, y, row["aoi"])))
        described = {"Columns": list(FIXATIONS), "OnsetSource": "timestamp", **_described(FIXATIONS)}
        _write_json(stem.with_name(f"{stem.name}_physioevents.json"), described)


def event_of(table: str, row: Row) -> Row:
    """Return a row of ``decisions``, ``performances`` or ``markers`` as an event."""
    event: Row = {"onset": row["session_s"], "duration": None, "trial_type": table.removesuffix("s")}
    if table == "markers":
        return event | {"text": re.sub(r"\s+", " ", row["text"])}
    event |= {"decision_id": row["decision_id"], "task": row["task"]}
    if table == "performances":
        return event | {"reward": row["reward"]}
    strategy = ", ".join(value for name, value in row.items() if name.startswith("strategy_"))
    return event | {
        "strategy": strategy, "cognitive_state": row["cognitive_state"], "propensity": row["propensity"],
    }  # fmt: skip


def stimulus_presentation(study: Study, screen: Screen) -> dict[str, Any]:
    """Return how the stimulus was seen, in metres and pixels: the study's settings and the given screen."""
    fixation = study.fixation
    return {
        "ScreenDistance": round(fixation.distance_cm / 100, 6),
        "ScreenOrigin": ["top", "left"],
        "ScreenResolution": [screen.width, screen.height],
        "ScreenSize": [round(fixation.screen_width_cm / 100, 6), round(fixation.screen_height_cm / 100, 6)],
    }


def write_data_set(out: Path, participants: Iterable[Row], sessions: Mapping[str, list[Row]], version: str) -> None:
    """Write the files of the whole data set: its description, its participants, and the ids of its labels."""
    described = {
        "Name": "Sessions of SHIFT", "BIDSVersion": VERSION, "DatasetType": "raw",
        "GeneratedBy": [{"Name": "shift-mesh", "Version": version}],
    }  # fmt: skip
    _write_json(out / "dataset_description.json", described)
    write_durably(out / "README", README.encode())
    _write_tsv(out / "participants.tsv", list(participants))
    _write_json(out / "participants.json", {"pseudonym": {"Description": "The participant's id in SHIFT."}})
    for label, rows in sessions.items():
        _write_tsv(out / f"sub-{label}" / f"sub-{label}_sessions.tsv", rows)
        _write_json(
            out / f"sub-{label}" / f"sub-{label}_sessions.json",
            {"session": {"Description": "The session's id in SHIFT."}, "file": {"Description": "The recording."}},
        )


README = """Sessions of SHIFT, exported by shift-mesh

Each session has the samples of its gaze (physio), its fixations (physioevents), and its decisions, performances and
markers (events). Gaze positions are in pixels of the screen that was given to the export. The time of events is the
time since the session's start; the time of gaze is that of its source, and session_time connects the two.
participants.tsv and the sessions.tsv files name the ids that the labels stand for.
"""


def _described(columns: Mapping[str, tuple[str, str]]) -> dict[str, dict[str, str]]:
    return {
        name: {"Description": meaning} | ({"Units": unit} if unit else {}) for name, (unit, meaning) in columns.items()
    }


def _line(values: Iterable[object]) -> bytes:
    cells = ("n/a" if value is None or value == "" else str(value) for value in values)
    return ("\t".join(cell.replace("\t", " ") for cell in cells) + "\n").encode()


def _write_tsv(path: Path, rows: list[Row]) -> None:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    write_durably(path, b"".join([_line(columns), *(_line(row.get(c) for c in columns) for row in rows)]))


def _write_json(path: Path, content: Mapping[str, Any]) -> None:
    write_durably(path, (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode())
