"""How much a recording's decisions depend on the accuracy of its gaze.

Each recording is decided again with gaze that is moved by 0.5, 1 and 2 degrees of visual angle in eight directions,
with noise of 0.5 degrees, and thinned to a half and to a fifth of its samples. The size of the stimulus and the
distance come from the study (``fixation``). Nothing else changes, so the share of decisions that stand says how far a
tracker's error reaches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from shift_model.random_numbers import uniform
from shift_recording.export.sources import first_session
from shift_recording.mcap.reader import Recording
from shift_recording.parallel import for_each
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Config, GazeChunk
from shift_study.constants import FixationSettings
from shift_study.loading import study_from_json
from shift_verify.verify import verify

from shift_analysis.counterfactual import Alternative, DecidedAgain, Redecider

DEGREES = (0.5, 1.0, 2.0)
DIRECTIONS = ("right", "down right", "down", "down left", "left", "up left", "up", "up right")
"""Each is 45 degrees clockwise from the one before it, as seen on the screen."""
NOISE_DEG = 0.5
THINNED = (2, 5)
"""One of so many samples is kept."""
NOISE_STREAM = 1000
"""The first of two streams of random numbers; no service and no simulation uses them."""
MOST_SAMPLES = 2**20
"""More than a chunk can have, so that each sample has random numbers of its own."""


@dataclass(frozen=True)
class Disturbance:
    """One way in which gaze is disturbed."""

    name: str
    shift_deg: float = 0.0
    direction: int = 0
    noise_deg: float = 0.0
    keep_every: int = 1

    def alternative(self, screen: FixationSettings, seed: int) -> Alternative:
        """Return the alternative with disturbed gaze for this screen; ``seed`` gives the noise."""
        return Alternative(gaze_of=partial(self._disturb, screen, seed))

    def _disturb(self, screen: FixationSettings, seed: int, chunk: GazeChunk) -> GazeChunk | None:
        if self.keep_every > 1:
            return self._thinned(chunk)
        return chunk if chunk.x is None or chunk.y is None else self._moved(screen, seed, chunk, chunk.x, chunk.y)

    def _thinned(self, chunk: GazeChunk) -> GazeChunk | None:
        """Keep one of ``keep_every`` samples, counted over the source as if its chunks had equal length."""
        first = -(chunk.seq * len(chunk.t)) % self.keep_every
        kept = slice(first, None, self.keep_every)
        columns = {name: getattr(chunk, name) for name in ("t", "x", "y", "valid", "aoi")}
        if not columns["t"][kept]:
            return None
        return chunk.model_copy(update={name: c[kept] for name, c in columns.items() if c is not None})

    def _moved(
        self, screen: FixationSettings, seed: int, chunk: GazeChunk, xs: list[float | None], ys: list[float | None]
    ) -> GazeChunk:
        """Move the points. Degrees are measured from the centre of the stimulus, at the study's distance."""
        angle = math.pi / 4 * self.direction
        distance = screen.distance_cm
        right = distance * math.tan(math.radians(self.shift_deg)) * math.cos(angle) / screen.screen_width_cm
        down = distance * math.tan(math.radians(self.shift_deg)) * math.sin(angle) / screen.screen_height_cm
        spread = distance * math.tan(math.radians(self.noise_deg))
        moved_x, moved_y = [], []
        for i, (x, y) in enumerate(zip(xs, ys, strict=True)):
            dx, dy = right, down
            if self.noise_deg:
                across, along = _normal_pair(seed, chunk.seq * MOST_SAMPLES + i)
                dx, dy = spread * across / screen.screen_width_cm, spread * along / screen.screen_height_cm
            moved_x.append(None if x is None else x + dx)
            moved_y.append(None if y is None else y + dy)
        return chunk.model_copy(update={"x": moved_x, "y": moved_y})


def _normal_pair(seed: int, n: int) -> tuple[float, float]:
    """Return two independent standard normal numbers of an address (Box & Muller 1958)."""
    radius = math.sqrt(-2 * math.log(1 - uniform(seed, n, NOISE_STREAM)))
    angle = 2 * math.pi * uniform(seed, n, NOISE_STREAM + 1)
    return radius * math.cos(angle), radius * math.sin(angle)


DISTURBANCES: tuple[Disturbance, ...] = (
    *(
        Disturbance(f"{degrees:g} deg {name}", shift_deg=degrees, direction=direction)
        for degrees in DEGREES
        for direction, name in enumerate(DIRECTIONS)
    ),
    Disturbance(f"noise {NOISE_DEG:g} deg", noise_deg=NOISE_DEG),
    *(Disturbance(f"one of {n} samples", keep_every=n) for n in THINNED),
)


@dataclass(frozen=True)
class Stands:
    """The number of decisions, and how many of them stand in each respect."""

    decisions: int = 0
    strategy: int = 0
    cognitive_state: int = 0
    gaze: int = 0

    def __add__(self, other: Stands) -> Stands:
        """Return the sums."""
        return Stands(
            self.decisions + other.decisions, self.strategy + other.strategy,
            self.cognitive_state + other.cognitive_state, self.gaze + other.gaze,
        )  # fmt: skip

    def as_json(self) -> dict[str, Any]:
        """Return the shares that stand; None without a decision."""
        shares = {
            name: getattr(self, name) / self.decisions if self.decisions else None
            for name in ("strategy", "cognitive_state", "gaze")
        }
        return {"decisions": self.decisions, **shares}


@dataclass(frozen=True)
class RecordingRobustness:
    """What stands in one recording under each disturbance, or why that is not known."""

    file: str
    participant: str = ""
    session: str = ""
    stands: dict[str, Stands] = field(default_factory=dict)
    """By the name of the disturbance."""
    has_points: bool = False
    """Whether there is gaze as points; names of AOIs are changed by thinning alone."""
    problem: str = ""


def robustness_of(path: Path) -> RecordingRobustness:
    """Decide one recording again with each disturbance."""
    try:
        session, screen = first_session(path), _screen_of(path)
        if session is None or screen is None:
            return RecordingRobustness(path.name, problem="it does not hold the session's start")
        redecider = Redecider([each.alternative(screen, session.seed) for each in DISTURBANCES])
        report = verify(path, observers=redecider.observers)
        if report.difference is not None:
            return RecordingRobustness(path.name, problem=f"it does not verify: {report.difference.sentence}")
        stands = {each.name: _stands(redecider.decisions(i)) for i, each in enumerate(DISTURBANCES)}
    except ShiftError as e:
        return RecordingRobustness(path.name, problem=e.detail)
    return RecordingRobustness(path.name, session.participant, session.session, stands, redecider.has_points)


def _screen_of(path: Path) -> FixationSettings | None:
    for recorded in Recording(path).facts(("config",)):
        assert isinstance(recorded.fact, Config)
        return study_from_json(recorded.fact.study).fixation
    return None


def _stands(decisions: Sequence[DecidedAgain]) -> Stands:
    """Count what stands. An override is the person's choice, so SHIFT's own choice is compared."""
    pairs = [(each.logged, each.other) for each in decisions]
    return Stands(
        decisions=len(pairs),
        strategy=sum(each.own == each.other.strategy for each in decisions),
        cognitive_state=sum(logged.cognitive_state == other.cognitive_state for logged, other in pairs),
        gaze=sum(logged.observation.gaze == other.observation.gaze for logged, other in pairs),
    )


def robustness(paths: Sequence[Path], workers: int = 0, scheduler: str = "") -> Iterator[RecordingRobustness]:
    """Yield what stands in each recording, in their order."""
    yield from for_each(robustness_of, paths, workers, scheduler)


@dataclass
class Robustness:
    """What stands over all recordings, and for each participant."""

    recordings: list[RecordingRobustness]

    @property
    def problems(self) -> dict[str, str]:
        """The recordings that could not be decided again, and why."""
        return {each.file: each.problem for each in self.recordings if each.problem}

    @property
    def participants(self) -> tuple[str, ...]:
        """The participants, in the order of their recordings."""
        return tuple(dict.fromkeys(each.participant for each in self.recordings if not each.problem))

    def stands(self, participant: str | None = None) -> dict[str, Stands]:
        """Return what stands under each disturbance, of one participant or of all."""
        found = {each.name: Stands() for each in DISTURBANCES}
        for recording in self.recordings:
            if participant is None or recording.participant == participant:
                found |= {name: found[name] + stands for name, stands in recording.stands.items()}
        return found

    def as_json(self) -> dict[str, Any]:
        """Return the answer as ``--json`` prints it."""
        counted = [each for each in self.recordings if not each.problem]
        return {
            "recordings": len(counted),
            "all": _json(self.stands()),
            "participants": {name: _json(self.stands(name)) for name in self.participants},
            "without_points": [each.file for each in counted if not each.has_points],
            "problems": self.problems,
        }  # fmt: skip


def _json(stands: dict[str, Stands]) -> dict[str, Any]:
    return {name: each.as_json() for name, each in stands.items()}
