"""Whole sessions in memory: the real cores of all four services, their facts exchanged in a random order.

What each owner put out waits in a queue per reader, and the next one to be read is drawn; so the services
run ahead of each other as processes do. The facts go through segments into a finished recording.
"""

from __future__ import annotations

import json
import random
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from shift_decider import core as decider
from shift_learner import core as learner
from shift_monitor import core as monitor
from shift_recorder import core as recorder
from shift_recording.checksum import sha256_of, write_checksum
from shift_recording.durable_file import DurableFile
from shift_recording.mcap.reader import RecordedMessage, Recording
from shift_recording.mcap.records import Attachment
from shift_recording.mcap.schemas import recorded_json, subject_schemas
from shift_recording.mcap.writer import RecordingWriter
from shift_recording.merging import finish_recording
from shift_recording.provenance import attachments_of, metadata_of
from shift_recording.segments import SegmentWriter
from shift_schemas.core_protocol import InputsMissing
from shift_schemas.messages import (
    FORMAT,
    AoiPositions,
    Command,
    Configure,
    Decide,
    EndSession,
    Fact,
    GazeChunk,
    Mark,
    ReportPerformance,
    Result,
    Seen,
    SetOverride,
    StartSession,
)
from shift_schemas.registry import READS
from shift_schemas.timestamps import Stamp

CORES: dict[str, Callable[..., Any]] = {
    "recorder": recorder.step, "monitor": monitor.step, "decider": decider.step, "learner": learner.step,
}  # fmt: skip
START = 1_700_000_000_000_000_000
SCHEMAS = subject_schemas()


class Session:
    """One session of study ``study`` in ``recording_format``; ``seed`` gives its random order."""

    def __init__(
        self,
        study: dict[str, Any] | None = None,
        seed: int = 1,
        recording_format: int = FORMAT,
        steady: bool = False,
        covariates: dict[str, str] | None = None,
    ) -> None:
        self.rng = random.Random(seed)
        self.now_ns = START
        self.states: dict[str, Any] = dict.fromkeys(CORES)
        self.heads = dict.fromkeys(CORES, 0)
        self.unread = {(r, o): deque[Fact]() for r, owners in READS.items() for o in owners if r != "recorder"}
        self.recorded: list[tuple[str, int, Fact]] = []
        self.unrecorded = {owner: deque[tuple[int, Fact]]() for owner in CORES}
        self.answered = Seen(config=1)
        self.gaze_s = 0.0
        self.steady = steady
        self.chunks = 0
        self.moves = 0
        self.moving = recording_format >= 6 and not steady and "aois" not in (study or {})
        given = {"study": "test", "tasks": ["a", "b"], **(study or {})}
        start = StartSession(
            command_id="start", session="s1", participant="P01", seed=7, study=given, format=recording_format,
            covariates=covariates or {},
        )  # fmt: skip
        self.do("recorder", start)

    def do(
        self, owner: str, message: Fact | Command | GazeChunk | monitor.Show, timed_out: bool = False
    ) -> tuple[Fact, ...]:
        """Step a core and put out what it gives."""
        self.now_ns += 1_000_000
        step = CORES[owner](self.states[owner], message, Stamp.of(self.now_ns), timed_out=timed_out)
        self.states[owner] = step.state
        for fact in step.facts:
            self._put(owner, fact)
        return tuple(step.facts)

    def _put(self, owner: str, fact: Fact) -> None:
        self.heads[owner] += 1
        self.unrecorded[owner].append((self.heads[owner], fact))
        for (_, of), queue in self.unread.items():
            if of == owner:
                queue.append(fact)

    def deliver(self, most: int = 10**9) -> None:
        """Let services read, in a random order, at most so many facts."""
        for _ in range(most):
            ready = [k for k, queue in self.unread.items() if queue and (k[1] == "recorder" or self._begun(k[0]))]
            if not ready:
                return
            reader, owner = self.rng.choice(ready)
            fact = self.unread[reader, owner].popleft()
            if fact.subject in READS[reader][owner]:
                self.do(reader, fact)

    def _begun(self, reader: str) -> bool:
        """Return whether a service knows the session and what it needs of the configuration."""
        state = self.states[reader]
        return state is not None and bool(reader == "decider" or state.config)

    def record(self, most: int = 10**9) -> None:
        """Let the recorder read, in a random order of owners."""
        for _ in range(most):
            ready = [o for o, queue in self.unrecorded.items() if queue]
            if not ready:
                return
            owner = self.rng.choice(ready)
            sequence, fact = self.unrecorded[owner].popleft()
            self.recorded.append((fact.subject, sequence, fact))

    def gaze(self, source: str = "tx300") -> None:
        """Publish a chunk of ten points around a random place, some of them lost; steady gaze stays in one place."""
        if self.moving and self.chunks % 4 == 1:
            self.move(source)
        x = 0.5 if self.steady else self.rng.random()
        t, xs, valid = [], [], []
        for _ in range(10):
            self.gaze_s += 1 / 60
            t.append(self.gaze_s)
            xs.append(x + self.rng.gauss(0, 0.002))
            valid.append(self.rng.random() > 0.05)
        points = [p if ok else None for p, ok in zip(xs, valid, strict=True)]
        self.do("monitor", GazeChunk(source=source, seq=self.chunks, t=t, x=points, y=points, valid=valid))
        self.answered = self.answered.model_copy(update={"gaze": {**self.answered.gaze, source: self.chunks}})
        self.chunks += 1 if self.rng.random() > 0.05 else 3  # some are lost on the way

    def move(self, source: str) -> None:
        """Move the AOI in the middle, or hide it, from the next sample on."""
        left = 0.3 + 0.02 * (self.moves % 20)
        aoi = {"name": "middle", "rectangle": [left, 0.1, left + 0.3, 0.9], "visible": self.moves % 5 != 4}
        given = {"source": source, "seq": self.moves, "t": self.gaze_s + 1 / 60, "aois": [aoi]}
        self.do("monitor", AoiPositions.model_validate(given))
        self.moves += 1

    def decide(self, n: int, timed_out: bool) -> None:
        """Ask for decision ``n``; with ``timed_out``, do not wait for its inputs."""
        command = Decide(command_id=f"d{n}", session="s1", task=self.rng.choice("ab"), need=self.answered)
        while True:
            try:
                self.do("decider", command, timed_out=timed_out)
                break
            except InputsMissing as missing:
                if missing.holding and self.rng.random() < 0.5:
                    self.do("monitor", monitor.Show())
                self.deliver(1)
        self.answered = self.answered.model_copy(update={"decision": n})

    def report(self, n: int) -> None:
        """Report how decision ``n`` went."""
        results = [Result(success=self.rng.random() > 0.4, duration_s=self.rng.uniform(0, 9)) for _ in range(2)]
        command = ReportPerformance(
            command_id=f"d{n}", session="s1", need=self.answered, comprehension=results[0], enabledness=results[1]
        )
        while True:
            try:
                self.do("learner", command)
                break
            except InputsMissing:
                self.deliver(1)
        self.answered = self.answered.model_copy(update={"performance": n})

    def change(self, n: int) -> None:
        """Change the configuration."""
        weight = {"strategies": {"negation": {"weight": 1 + n / 20}}}
        patch = {"capacity": {"recovery": 0.3 + n / 1000}, "scoring": weight}
        facts = self.do("recorder", Configure(command_id=f"c{n}", session="s1", patch=patch))
        self.answered = self.answered.model_copy(update={"config": facts[0].version})  # type: ignore[attr-defined]

    def override(self, n: int) -> None:
        """Choose a task's next strategy."""
        strategy = {"negation": "negation", "hesitation": "none"}
        command = SetOverride(command_id=f"o{n}", session="s1", task="a", strategy=strategy, reason="so")
        self.do("decider", command, timed_out=True)

    def interactions(self, count: int) -> Session:
        """Run so many interactions with every kind of event."""
        self.deliver()
        for n in range(1, count + 1):
            for _ in range(self.rng.randrange(5)):
                self.gaze("tx300" if n < count / 2 else "spare")
                self.deliver(self.rng.randrange(4))
            if n % 11 == 3:
                self.override(n)
            if n % 13 == 4:
                self.change(n)
            if n % 17 == 5:
                self.do("recorder", Mark(command_id=f"m{n}", session="s1", text="noted"))
            self.decide(n, timed_out=self.rng.random() < 0.15)
            self.deliver(self.rng.randrange(6))
            self.report(n)
            self.record(self.rng.randrange(30))
        return self

    def ended(self) -> Session:
        """End it, and let everybody read everything."""
        self.do("recorder", EndSession(command_id="end", session="s1"))
        self.deliver()
        self.now_ns += 1_000_000
        state: recorder.RecorderState = self.states["recorder"]
        self.states["recorder"] = replace(state, fact=recorder.ended(state))
        self._put("recorder", self.states["recorder"].fact)
        self.record()
        return self

    # --- files ---

    def segment(self, folder: Path) -> Path:
        """Write the recorded facts to a segment, as a crash leaves it."""
        segment = SegmentWriter(folder / "segments", "s1", SCHEMAS)
        for i, (subject, sequence, fact) in enumerate(self.recorded):
            log_time = START + 10**9 + i * 1_000_000
            segment.write(subject, sequence, log_time, fact.stamp.ns, recorded_json(fact))
        segment.flush()
        segment.abandon()
        return segment.path

    def finished(self, folder: Path) -> Path:
        """Write the recording with its metadata and its checksum."""
        done = finish_recording(
            "s1", [self.segment(folder)], folder / "s1.mcap",
            schemas=SCHEMAS, metadata=self.metadata(), attachments=self.attachments(),
        )  # fmt: skip
        return done.path

    def metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata as the recorder's shell writes it."""
        state: recorder.RecorderState = self.states["recorder"]
        return metadata_of(state.fact, state.config)

    def attachments(self) -> list[Attachment]:
        """Return the attachments as the recorder's shell writes them."""
        state: recorder.RecorderState = self.states["recorder"]
        policies = [recorded_json(fact) for subject, _, fact in self.recorded if subject == "policy"]
        ends = (policies[0], policies[-1]) if policies else None
        files = attachments_of(state.config, state.original, ends)
        return [Attachment(name, "application/json", data, START) for name, data in files.items()]


Edit = Callable[[list[RecordedMessage]], Iterable[RecordedMessage]]


def rewritten(recording: Path, folder: Path, edit: Edit, checksum: bool = True) -> Path:
    """Write the recording with edited messages; everything else is valid, including all checksums."""
    source = Recording(recording)
    messages = list(source.messages())
    folder.mkdir(exist_ok=True)
    target = folder / recording.name
    file = DurableFile(target, new=False)
    writer = RecordingWriter(file, SCHEMAS, 2**20)
    for name, values in source.metadata.items():
        writer.metadata(name, values)
    for attachment in source.attachments.values():
        writer.attachment(attachment)
    for message in edit(messages):
        writer.message(*message)
    writer.finish()
    file.close()
    if checksum:
        write_checksum(target, sha256_of(target))
    return target


def changed(subject: str, number: int, path: Sequence[str | int], change: Callable[[Any], Any]) -> Edit:
    """Return an edit of one field of the ``number``-th message (from 0) of a subject."""

    def edit(messages: list[RecordedMessage]) -> list[RecordedMessage]:
        place = [i for i, m in enumerate(messages) if m.topic == subject][number]
        data = json.loads(messages[place].data)
        inner = data
        for key in path[:-1]:
            inner = inner[key]
        before = inner.get(path[-1]) if isinstance(inner, dict) else inner[path[-1]]  # type: ignore[arg-type]
        inner[path[-1]] = change(before)  # type: ignore[index]
        messages[place] = messages[place]._replace(data=json.dumps(data).encode())
        return messages

    return edit


def without(subject: str, number: int) -> Edit:
    """Return an edit that drops one message."""

    def edit(messages: list[RecordedMessage]) -> list[RecordedMessage]:
        place = [i for i, m in enumerate(messages) if m.topic == subject][number]
        return messages[:place] + messages[place + 1 :]

    return edit
