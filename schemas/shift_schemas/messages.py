"""The messages: facts, the gaze stream, commands and their answers.

A fact is frozen, names what happened and has exactly one owner. Its ``subject`` is its key's last part
and the recording's topic. A ``None`` is left out of a recording, whose schemas have no unions.
"""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from shift_model.vocabulary import AwarenessClass, CapacityClass, GazeClass, LearnerName, PolicySource

from shift_schemas.ids import Id
from shift_schemas.timestamps import Stamp

Strategy = dict[str, str]
Count = Annotated[int, Field(ge=0, le=2**53)]
SessionState = Literal["live", "ending", "ended"]
GazeOutcome = Literal["applied", "late"]
Seconds = Annotated[float, Field(ge=-1e11, le=1e11)]
Text = Annotated[str, Field(max_length=10_000)]
MOST_WARNINGS = 100
Warnings = Annotated[list[str], Field(max_length=MOST_WARNINGS)]
FORMAT = 2
"""What a session records. 1: no shares of gaze, no warnings, no restarts. A session keeps its first format."""
DEEPEST = 32
"""Nesting of a plain JSON object within a message; a study has 6."""


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Refuse what JSON cannot say back: infinite numbers (``1e999`` is one), half characters, bottomless nesting."""
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        if any(isinstance(v, float) and not isfinite(v) for v in level):
            raise ValueError("a number must be finite")
        if any(isinstance(v, str) and not v.isascii() and any("\ud800" <= c <= "\udfff" for c in v) for v in level):
            raise ValueError("half of a character (a lone surrogate) is no text")
        inner = [v for v in level if isinstance(v, (dict, list))]
        level = [w for v in inner for w in ((*v, *v.values()) if isinstance(v, dict) else v)]
        if not level:
            return value
    raise ValueError(f"it is nested deeper than {DEEPEST} levels")


JsonObject = Annotated[dict[str, Any], AfterValidator(_plain)]
"""A JSON object as it came, of which only is known that it can be said back."""


class Message(BaseModel):
    """Anything that travels."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Seen(Message):
    """How far the sender had read each of its inputs; as ``need``, how far the answerer must have."""

    gaze: dict[Id, Count] = Field(default={}, description="Per source, the last chunk's number.")
    decision: Count = Field(default=0, description="Number of the last decision.")
    performance: Count = Field(default=0, description="How many performances.")
    config: Count = Field(default=0, description="Version of the configuration.")
    observation: Count = Field(default=0, description="Version of the observation.")
    policy: Count = Field(default=0, description="Version of the policy.")


class Fact(Message):
    """What happened, put out by its one owner."""

    subject: ClassVar[str]

    session: Id = Field(description="The session it belongs to.")
    stamp: Stamp = Field(description="When its owner made it, wall clock; order is by the owner's sequence.")
    seen: Seen = Field(default=Seen(), description="How far its owner had read its inputs.")


# --- the recorder's ---


class Session(Fact):
    """A session began, is ending or ended."""

    subject = "session"

    participant: Id = Field(description="Pseudonym of the participant.")
    study: Id = Field(description="The study's id.")
    condition: Id | None = Field(default=None, description="The study's condition; none: its own values.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] = Field(description="Seed of every draw of the session.")
    state: SessionState = Field(description="live, ending (nothing is taken any more) or ended.")
    started: Stamp = Field(description="When it began.")
    ended: Stamp | None = Field(default=None, description="When it ended.")
    recording: str = Field(default="", description="Name of the finished recording.")
    sha256: str = Field(default="", description="Its checksum; empty within the recording itself.")
    counts: dict[str, Count] = Field(default={}, description="Messages of the session by topic.")
    replay_of: str = Field(default="", description="Name of the recording that this session replays.")
    software: str = Field(default="", description="Version of shift-mesh.")
    revision: str = Field(default="", description="Git revision of shift-mesh, where known.")
    format: Count = Field(default=1, description="Which facts and fields the session records; today 2.")
    warnings: Warnings = Field(default=[], description="What was accepted at its start and may not be meant.")


class Config(Fact):
    """The study in force, from here on."""

    subject = "config"

    version: Count = Field(ge=1, description="1 at the start, one more per change.")
    study: str = Field(description="The study in force as one JSON string.")


class Marker(Fact):
    """A note of the experimenter."""

    subject = "marker"

    marker_id: Id = Field(description="Its id.")
    text: Text = Field(description="What was noted.")


# --- the monitor's ---


class Gaze(Fact):
    """A chunk of gaze as it was applied. Columns of equal length; a lost sample is 0, 0, invalid."""

    subject = "gaze"

    source: Id = Field(description="The gaze source.")
    seq: Count = Field(description="Number of the chunk within its source, from 0.")
    segment: Count = Field(default=0, description="One more with each restart of the source's clock or numbering.")
    outcome: GazeOutcome = Field(default="applied", description="late: recorded, not applied.")
    t: list[Seconds] = Field(description="Source clock, s.")
    x: list[float] = Field(default=[], description="0..1 from the left; empty for gaze on AOIs.")
    y: list[float] = Field(default=[], description="0..1 from the top; empty for gaze on AOIs.")
    valid: list[bool] = Field(default=[], description="Whether the sample is one; empty for gaze on AOIs.")
    aoi: list[str] = Field(default=[], description="AOI names, '' is none; empty for points.")
    warnings: Warnings = Field(default=[], description="What was accepted and may not be meant, or has no effect.")


class Fixation(Fact):
    """A finished fixation, on the source's clock."""

    subject = "fixation"

    source: Id = Field(description="The gaze source.")
    segment: Count = Field(default=0, description="The segment of the source that it began in.")
    start_s: Seconds = Field(description="Start, source clock, s.")
    duration_s: Annotated[float, Field(ge=0)] = Field(description="Duration, s.")
    x: float = Field(description="Mean position, 0..1 from the left.")
    y: float = Field(description="Mean position, 0..1 from the top.")
    aoi: str = Field(description="The AOI at the mean position; '' is none.")


class CapacityView(Message):
    """Processing capacity."""

    value: float = Field(description="Its value.")
    category: CapacityClass = Field(description="low or high.")


class GazeView(Message):
    """The visual distribution of attention."""

    category: GazeClass = Field(description="distracted, uncertain or focused.")
    weights: dict[Id, float] = Field(description="Attention weight per AOI; they sum to 1.")
    focus_shift: float = Field(description="Focus shift, 0..1.")
    aoi: str = Field(description="The held target; '' is none.")
    fixations: Count = Field(description="Finished fixations so far.")
    dropped: Count = Field(description="Gaze chunks that never came, by their numbers.")
    restarts: Count | None = Field(default=None, description="How often a source began its clock or numbering anew.")
    samples: Count | None = Field(default=None, description="Samples applied, all sources together.")
    dwell_s: float | None = Field(default=None, description="Dwell on AOIs in this session, s.")
    lost: float | None = Field(default=None, description="Share of the source's time without a valid sample, 0..1.")
    unclassified: float | None = Field(default=None, description="Share of its time in no fixation, 0..1.")
    off_aoi: float | None = Field(default=None, description="Share of its time on no AOI, 0..1.")
    off_stimulus: float | None = Field(
        default=None, description="Share of its time with points outside 0..1; part of unclassified or off_aoi."
    )
    received: Stamp | None = Field(default=None, description="When the last applied sample was received.")
    age_s: float | None = Field(default=None, description="Time since then at the observation's stamp, s.")


class AwarenessView(Message):
    """What the results of one task say."""

    category: AwarenessClass = Field(description="The class.")
    comprehension: float = Field(description="Success ratio over the window.")
    enabledness: float = Field(description="Success ratio over the window.")
    results: Count = Field(description="Results so far.")


class Observation(Fact):
    """The whole partner model."""

    subject = "observation"

    version: Count = Field(ge=1, description="One more with each observation.")
    capacity: CapacityView
    gaze: GazeView
    awareness: dict[Id, AwarenessView] = Field(description="Per task that has results.")
    warnings: Warnings = Field(default=[], description="Those of the last gaze and of the last result.")


# --- the decider's ---


class TripleView(Message):
    """One of the 30 monitoring states."""

    capacity: CapacityClass
    gaze: GazeClass
    awareness: AwarenessClass


class Estimate(Fact):
    """Scores and cognitive state for one task, put out when they change."""

    subject = "estimate"

    task: str = Field(description="The task; '' stands for every task without results.")
    observation: TripleView
    scores: dict[str, float] = Field(description="Each strategy's score.")
    cognitive_state: str = Field(description="The state that the scores reduce to.")
    suggested: Strategy = Field(description="The scoring system's action.")


class Versions(Message):
    """What a decision was derived from."""

    observation: Count
    policy: Count = Field(description="0: there was none.")
    config: Count


class Decision(Fact):
    """Which strategy, and why."""

    subject = "decision"

    decision_id: Id
    task: Id
    n: Count = Field(ge=1, description="Number of the decision in its session.")
    strategy: Strategy = Field(description="The strategy to use now, one level each.")
    observation: TripleView
    scores: dict[str, float] = Field(description="Each strategy's score.")
    cognitive_state: str = Field(description="The cognitive state.")
    suggested: Strategy = Field(description="The scoring system's action.")
    actions: list[Strategy] = Field(description="All actions, in their fixed order.")
    probabilities: list[float] = Field(description="The policy's row, per action; sums to 1.")
    propensity: float | None = Field(
        default=None, description="Probability of the strategy taken; none where it was overridden."
    )
    explored: bool = Field(description="Not the greedy action.")
    policy_source: PolicySource = Field(description="learner, last_policy, scoring or override.")
    versions: Versions
    stale: bool = Field(description="The observation had not seen all that it must have.")
    state: str = Field(description="The row of the policy that was drawn from.")
    seed: Count = Field(description="The session's seed; the draw's generator is seeded by (seed, n).")
    override_id: str = Field(default="", description="The override that it follows; '' is none.")
    reason: str = Field(default="", description="The override's reason.")


class Override(Fact):
    """The experimenter chose the strategy of a task's next decision."""

    subject = "override"

    override_id: Id
    task: Id
    strategy: Strategy
    reason: Text = ""


# --- the learner's ---


class Result(Message):
    """How one dimension of the task went."""

    success: bool
    duration_s: Annotated[float, Field(ge=0, le=1e6)] = Field(description="Time to solve it (T), s.")


class ScoredResult(Result):
    """A result with its task performance."""

    value: float = Field(description="success x exp(-decay x duration_s).")


class Performance(Fact):
    """How the task went, and the reward of it."""

    subject = "performance"

    decision_id: Id
    task: Id
    n: Count = Field(ge=1, description="Number of the performance in its session.")
    comprehension: ScoredResult
    enabledness: ScoredResult
    reward: float
    cumulative_reward: float
    corrects: bool = Field(default=False, description="It replaces an earlier report of the same decision.")
    result: Count = Field(
        default=0, description="Which of the task's results it is, from 1; a correction has that of the first report."
    )
    warnings: Warnings = Field(default=[], description="What was accepted and may not be meant.")


class Transition(Fact):
    """What was learned from: state, action, reward."""

    subject = "transition"

    decision_id: Id
    task: Id
    state: str = Field(description="The row that was updated.")
    action: Strategy
    reward: float
    propensity: float | None = Field(default=None, description="None where the action was an override.")
    versions: Versions
    value: float = Field(description="The row's value of the action after the update.")


class PolicyRow(Message):
    """One state's row."""

    probabilities: list[float] = Field(description="Per action; sums to 1.")
    values: list[float] = Field(description="What they were made from, per action.")
    visits: list[Count] = Field(description="Reported decisions per action.")


class Policy(Fact):
    """Action probabilities for each state, for one decision number."""

    subject = "policy"

    version: Count = Field(ge=1)
    learner: LearnerName
    for_n: Count = Field(ge=1, description="The decision number that it holds for.")
    actions: list[Strategy]
    states: dict[str, PolicyRow]
    epsilon: float | None = Field(default=None, description="Probability of exploring, where the learner has one.")
    cumulative_reward: float = 0.0


FACTS: dict[str, type[Fact]] = {
    f.subject: f
    for f in (
        Session, Config, Gaze, Fixation, Observation, Estimate, Decision, Override,
        Performance, Transition, Policy, Marker,
    )
}  # fmt: skip
"""Every fact by its subject, in the recording's order of topics."""


# --- the gaze stream ---


class GazeChunk(Message):
    """A chunk of gaze, points on the stimulus or AOI names, as a source sends it."""

    source: Id = Field(description="The gaze source.")
    seq: Count = Field(description="Number of the chunk within its source, from 0.")
    t: Annotated[list[Seconds], Field(min_length=1)] = Field(description="Rising; seconds of the source's clock.")
    x: list[float | None] | None = Field(default=None, description="0..1 from the left; null where lost.")
    y: list[float | None] | None = Field(default=None, description="0..1 from the top; null where lost.")
    valid: list[bool] | None = Field(default=None, description="Left out: valid wherever x and y are there.")
    aoi: list[str | None] | None = Field(default=None, description="AOI names; null is none of them.")

    @model_validator(mode="after")
    def _columns(self) -> GazeChunk:
        if self.aoi is not None:
            if self.x is not None or self.y is not None or self.valid is not None:
                raise ValueError("give either aoi, or x and y with valid")
            columns: list[tuple[str, list[Any] | None]] = [("aoi", self.aoi)]
        elif self.x is None or self.y is None:
            raise ValueError("give either aoi, or x and y with valid")
        else:
            columns = [("x", self.x), ("y", self.y), ("valid", self.valid)]
        for name, column in columns:
            if column is not None and len(column) != len(self.t):
                raise ValueError(f"{name} has {len(column)} entries and t has {len(self.t)}; they must be as many")
        if any(b <= a for a, b in zip(self.t, self.t[1:], strict=False)):
            raise ValueError("t must rise within a chunk")
        if self.valid is not None and self.x is not None and self.y is not None:
            for i, ok in enumerate(self.valid):
                if ok and (self.x[i] is None or self.y[i] is None):
                    raise ValueError(f"sample {i} is valid and has no x or y")
        return self


# --- commands; each carries an id, and the reply is the acknowledgement ---


class Command(Message):
    """What a door asks of a fact's owner. ``command_id`` names it: a repeat gets the first result."""

    procedure: ClassVar[str]

    command_id: Id
    session: Id
    need: Seen = Field(default=Seen(), description="What the answerer must have seen: read your own writes.")

    beside: ClassVar[frozenset[str]] = frozenset({"need", "command_id"})
    """Fields that do not make it another command."""

    def content(self) -> str:
        """What makes a repeat a repeat: everything but what the door had seen by then."""
        return self.model_dump_json(exclude=set(self.beside))


START_ID, END_ID = "start", "end"
"""Start and end have no id of their own: a session has one of each, and a repeat gets the first result."""


class StartSession(Command):
    """Begin a session."""

    procedure = "start_session"
    beside = frozenset({"need", "command_id", "format", "warnings"})

    participant: Id
    study: str | JsonObject = Field(default="default", description="A study's id, or the study itself.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    condition: Id | None = None
    replay_of: str = ""
    software: str = ""
    revision: str = ""
    format: Count = FORMAT
    warnings: Warnings = Field(default=[], description="What was found when the study was read.")


class EndSession(Command):
    """End a session: nothing more is taken, the recording is finished."""

    procedure = "end_session"


class Configure(Command):
    """Change the study in force by a JSON merge patch."""

    procedure = "configure"

    patch: JsonObject


class Mark(Command):
    """Note something in the recording."""

    procedure = "mark"

    text: Text


class Decide(Command):
    """Which strategy now, for this task?"""

    procedure = "decide"

    task: Id


class SetOverride(Command):
    """Choose the strategy of the task's next decision."""

    procedure = "override"

    task: Id
    strategy: Strategy
    reason: Text = ""

    def content(self) -> str:
        """The same levels in another order are the same content."""
        levels = dict(sorted(self.strategy.items()))
        return Command.content(self.model_copy(update={"strategy": levels}))


class ReportPerformance(Command):
    """How the task went. ``command_id`` is the decision's id; a correction has an id of its own."""

    procedure = "report_performance"

    comprehension: Result
    enabledness: Result
    corrects: Id | None = Field(default=None, description="The decision whose report this one replaces.")

    def content(self) -> str:
        """A first report's content has no ``corrects``, as before there were corrections."""
        beside = self.beside if self.corrects is not None else {*self.beside, "corrects"}
        return self.model_dump_json(exclude=set(beside))

    @property
    def decision_id(self) -> str:
        """The decision that is reported."""
        return self.corrects or self.command_id


COMMANDS: dict[str, type[Command]] = {
    c.procedure: c for c in (StartSession, EndSession, Configure, Mark, Decide, SetOverride, ReportPerformance)
}


# --- between a service and its readers ---


class OutboxQuery(Message):
    """What a reader asks an owner: all facts after these cursors, and which sessions there are."""

    cursors: dict[Id, Count] = Field(default={}, description="Per session, the last sequence that was read.")
    limit: Annotated[int, Field(ge=1, le=10_000)] = 1000
    only: list[Id] | None = Field(default=None, description="Only these sessions; none: all.")
    closed: bool = Field(default=False, description="Sessions that ended as well.")


class OutboxRow(Message):
    """One fact in its owner's journal."""

    session: Id
    seq: Count
    subject: str
    payload: str = Field(description="The fact as JSON.")


class OutboxPage(Message):
    """The answer: rows in order, the heads of the sessions, and how far the owner itself has read."""

    owner: str
    rows: list[OutboxRow]
    heads: dict[Id, Count]
    cursors: dict[Id, dict[str, Count]] = Field(default={}, description="session -> owner -> sequence read.")
    complete: bool = Field(description="No more rows than these.")


class Answer(Message):
    """A command's or stream's reply: the acknowledgement."""

    owner: str = Field(description="The service that answered.")
    seq: Count = Field(description="The owner's sequence in this session with the effects of it.")
    repeat: bool = Field(default=False, description="It had been carried out before; this is the first result.")
    result: dict[str, Any]


class Health(Message):
    """A worker's own answer, through its own loop."""

    service: str = Field(description="The service that answers.")
    ready: bool = Field(description="It has read every journal that it needs, and the disk takes its own.")
    detail: str = Field(default="", description="What it waits for.")
    sessions: Count = Field(default=0, description="Sessions in memory.")
    unreached: list[str] = Field(default=[], description="Owners that it reads and that have not answered it lately.")
    mesh: str = Field(default="", description="Id of its data folder: two owners under one key differ in it.")
    since: Stamp | None = Field(default=None, description="When its process began.")
    data: str = Field(default="", description="Its data folder.")
