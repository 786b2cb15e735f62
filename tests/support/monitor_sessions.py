"""Sessions, studies and recordings that several of the monitor's tests use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shift_monitor.core import MonitorState, Show, step
from shift_monitor.gaze_input import gaze_input
from shift_schemas.messages import (
    FORMAT,
    Config,
    Decision,
    Fact,
    Fixation,
    Gaze,
    GazeChunk,
    Message,
    Observation,
    Performance,
    ScoredResult,
    Session,
    TripleView,
    Versions,
)
from shift_schemas.timestamps import Stamp
from shift_sources.files.formats import read_samples
from shift_sources.files.samples import Sample, chunks
from shift_study.loading import study_json, study_of
from shift_study.study import Study

NOW = Stamp(sec=1_700_000_000, nsec=0)
RECORDINGS = sorted((Path(__file__).parents[1] / "data" / "gaze").glob("*.tsv.gz"))
AFFIRMATION = {"negation": "affirmation", "hesitation": "none"}
NEGATION = {"negation": "negation", "hesitation": "none"}


def study(**parts: Any) -> Study:
    return study_of({"study": "test"} | parts)


def session(state: str = "live") -> Session:
    return Session(
        session="s1", stamp=NOW, participant="P01", study="test", seed=7, state=state, started=NOW, format=FORMAT,
    )  # type: ignore[arg-type]  # fmt: skip


def config(of: Study, version: int = 1) -> Config:
    return Config(session="s1", stamp=NOW, version=version, study=study_json(of))


def decision(n: int, strategy: dict[str, str] = AFFIRMATION) -> Decision:
    return Decision(
        session="s1", stamp=NOW, decision_id=f"d{n}", task="grasp", n=n, strategy=strategy,
        observation=TripleView(capacity="high", gaze="uncertain", awareness="unknown"), scores={},
        cognitive_state="engaged_observer", suggested=strategy, actions=[strategy], probabilities=[1.0],
        propensity=1.0, explored=False, policy_source="scoring",
        versions=Versions(observation=1, policy=0, config=1), stale=False, state="engaged_observer", seed=7,
    )  # fmt: skip


def performance(n: int, comprehension: bool, enabledness: bool, task: str = "grasp") -> Performance:
    def scored(success: bool) -> ScoredResult:
        return ScoredResult(success=success, duration_s=5.0, value=0.6 if success else -0.6)

    return Performance(
        session="s1", stamp=NOW, decision_id=f"d{n}", task=task, n=n, reward=0.0, cumulative_reward=0.0,
        comprehension=scored(comprehension), enabledness=scored(enabledness),
    )  # fmt: skip


def points(seq: int, t: list[float], x: list[float | None], y: float = 0.5, source: str = "eyes") -> GazeChunk:
    return GazeChunk(source=source, seq=seq, t=t, x=x, y=[None if v is None else y for v in x])


def names(seq: int, t: list[float], aoi: list[str | None], source: str = "ros") -> GazeChunk:
    return GazeChunk(source=source, seq=seq, t=t, aoi=aoi)


def configured_session(of: Study | None = None) -> MonitorState:
    """Return the state of a session that has its configuration."""
    return fold(None, session(), config(of or study()))[0]


class Recorded:
    """The gaze facts that the monitor published, looked up as its journal does."""

    def __init__(self) -> None:
        self.gaze: list[Gaze] = []

    def __call__(self, subject: str, **fields: object) -> list[Gaze]:
        return [g for g in self.gaze if all(getattr(g, name) == value for name, value in fields.items())]


def fold(
    state: MonitorState | None, *events: Message, recorded: Recorded | None = None
) -> tuple[MonitorState, list[Fact]]:
    """Step through events and show each observation at once; ``recorded`` and the gaze tell repeats from restarts."""
    facts: list[Fact] = []
    kept = recorded or Recorded()
    for event in events:
        done = step(state, gaze_input(event, kept) if isinstance(event, GazeChunk) else event, NOW)
        kept.gaze += [f for f in done.facts if isinstance(f, Gaze)]
        shown = step(done.state, Show(), NOW)
        state = shown.state
        facts += (*done.facts, *shown.facts)
    assert state is not None
    return state, facts


def last(facts: list[Fact]) -> Observation:
    found = facts[-1]
    assert isinstance(found, Observation)
    return found


def fixations(facts: list[Fact]) -> list[Fixation]:
    return [f for f in facts if isinstance(f, Fixation)]


def recording(path: Path) -> list[Sample]:
    return list(read_samples(path))


def played(taken: list[Sample], n: int, of: Study | None = None) -> tuple[MonitorState, list[Fact]]:
    """Fold a session of these samples in chunks of ``n``, from its start to its end."""
    return fold(configured_session(of), *chunks(taken, n), session("ending"))
