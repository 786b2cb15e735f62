"""The tables of an export, and the rows of one recording. Pure.

Every row begins with ``session``, ``participant`` and ``condition``. ``session_s`` is the time since the start of
the session by the wall clock of the mesh, ``t_s`` the time of the gaze source.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from shift_schemas.messages import (
    Aois,
    Clock,
    Config,
    Decision,
    Estimate,
    Fact,
    Fixation,
    Gaze,
    GazeView,
    Marker,
    Observation,
    Override,
    Performance,
    Session,
    Transition,
)
from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json
from shift_study.study import Study

from shift_recording.export.columns import Column, Names, columns_of, values_of
from shift_recording.mcap.reader import RecordedFact

TABLES: dict[str, type[Fact]] = {
    "gaze": Gaze, "fixations": Fixation, "observations": Observation, "estimates": Estimate,
    "decisions": Decision, "performances": Performance, "transitions": Transition, "markers": Marker,
    "overrides": Override,
    "clocks": Clock, "aois": Aois,
}  # fmt: skip
"""The tables with one row for each fact, and its class; ``gaze`` has one row for each sample."""
TABLE_OF = {kind.subject: name for name, kind in TABLES.items()}

KEYS = (
    Column("session", "text", "The session.", "session"),
    Column("participant", "text", "The participant's pseudonym.", "session"),
    Column("condition", "text", "The study's condition; empty without one.", "session"),
)
SESSION_TIME = Column("session_s", "number", "Time since the session's start, by the clock of the mesh.", "")
GAZE = (
    Column("source", "text", "The gaze source.", "gaze"),
    Column("segment", "integer", "Counts the restarts of the source's clock or numbering.", "gaze"),
    Column("seq", "integer", "Number of the chunk within its source.", "gaze"),
    Column("sample", "integer", "Number of the sample within its chunk, from 0.", "gaze"),
    Column("outcome", "text", "applied; late: recorded, not applied.", "gaze"),
    Column("stamp_utc", "time", "When the monitor applied the chunk.", "gaze"),
    Column(
        "session_s",
        "number",
        "Time since the session's start: the chunk's last sample at the chunk's stamp, the others before it by the "
        "source's clock.",
        "gaze",
    ),
    Column("t_s", "number", "Time on the source's clock.", "gaze"),
    Column("x", "number", "Position, 0..1 from the left; empty for a lost sample and for gaze on AOIs.", "gaze"),
    Column("y", "number", "Position, 0..1 from the top; empty for a lost sample and for gaze on AOIs.", "gaze"),
    Column("valid", "boolean", "Whether the sample is valid; empty for gaze on AOIs.", "gaze"),
    Column("aoi", "text", "The AOI that the source named; empty for points and for no AOI.", "gaze"),
    Column(
        "hit",
        "text",
        "The AOI at the sample's point, of those that held at its time; the first one where they overlap. Empty for no "
        "AOI, for a lost sample and for gaze on AOIs. The model counts dwell within fixations instead.",
        "gaze",
    ),
    *(
        Column(
            f"{what}_{eye}", "number", f"{meaning} of the {eye} eye, in the source's unit; empty where lost.", "gaze"
        )
        for what, meaning in (("pupil", "Pupil size"), ("openness", "Openness"))
        for eye in ("left", "right")
    ),
)
AOIS = (
    Column("stamp_utc", "time", "When the monitor applied the message.", "aois"),
    Column("source", "text", "The gaze source on whose clock the AOI moves.", "aois"),
    Column("seq", "integer", "Number of the message within its source.", "aois"),
    Column("segment", "integer", "Counts the restarts of the time or the numbering.", "aois"),
    Column("outcome", "text", "applied; late: recorded, not applied.", "aois"),
    Column("t_s", "number", "From when on it holds, on the source's clock.", "aois"),
    Column("name", "text", "The AOI.", "aois"),
    Column("visible", "boolean", "Whether gaze can fall on it.", "aois"),
    Column("left", "number", "Left edge of a rectangle, 0..1; empty without one.", "aois"),
    Column("top", "number", "Top edge of a rectangle, 0..1; empty without one.", "aois"),
    Column("right", "number", "Right edge of a rectangle, 0..1; empty without one.", "aois"),
    Column("bottom", "number", "Bottom edge of a rectangle, 0..1; empty without one.", "aois"),
    Column("polygon", "text", "The corners of a polygon, x y each; empty without one.", "aois"),
)
ABOUT_FILE = (
    Column("file", "text", "The recording.", ""),
    Column("complete", "boolean", "Whether the session ended and the file is whole.", ""),
    Column("incomplete_reason", "text", "Why it is not.", ""),
    Column("duration_s", "number", "From the session's start to its end; empty if it has not ended.", "session"),
)
ACTION = Column("action", "integer", "Number of the strategy among the actions, from 1.", "decision")
RESULT = ("comprehension_success", "comprehension_duration_s", "comprehension_value", "enabledness_success",
          "enabledness_duration_s", "enabledness_value", "reward", "cumulative_reward")  # fmt: skip
"""What a decision's row repeats of its performance."""
Row = dict[str, Any]


GAZE_VIEW = {column.name for column in columns_of(GazeView, Names(), "observation", "gaze_")} | {"gaze_category"}
"""The columns of what an observation says of gaze, without the weights."""


def names_in(facts: Iterable[Fact], names: Names) -> None:
    """Add the names in configurations, decisions and performances to ``names``."""
    for fact in facts:
        match fact:
            case Config():
                study = study_from_json(fact.study)
                names.aois |= dict.fromkeys(study.aoi_names)
                names.tasks |= dict.fromkeys(study.tasks or ())
                names.strategies |= dict.fromkeys(study.scoring.strategies)
            case Decision():
                names.tasks[fact.task] = None
                names.actions = max(names.actions, len(fact.actions))


def table_columns(names: Names, covariates: Iterable[str] = ()) -> dict[str, tuple[Column, ...]]:
    """Return the columns of each table."""
    given = [Column(name, "text", "A covariate of the participant, as given.", "covariates") for name in covariates]
    about = [
        c
        for c in columns_of(Session, names, "session")
        if c.name not in ("participant", "condition", "counts", "covariates")
    ]
    found = {"sessions": (*KEYS, *given, *ABOUT_FILE, *about), "gaze": (*KEYS, *GAZE)}
    for table, kind in TABLES.items():
        if table == "aois":
            found[table] = (*KEYS, SESSION_TIME, *AOIS)
        elif table != "gaze":
            found[table] = (*KEYS, SESSION_TIME, *columns_of(kind, names, kind.subject))
    partner = [c for c in found["observations"] if _is_partner(c.name)]
    results = [c for c in found["performances"] if c.name in RESULT]
    found["decisions"] += (ACTION,)
    found["decisions"] += tuple(
        Column(c.name, c.type, f"{c.meaning} In the observation that the decision saw.", c.source) for c in partner
    )
    found["decisions"] += tuple(
        Column(c.name, c.type, f"{c.meaning} In the decision's last report; empty without one.".strip(), c.source)
        for c in results
    )
    return found


def _is_partner(column: str) -> bool:
    """Return whether a decision's row repeats a column of the observation that it saw: capacity, weights and gaze."""
    return column == "capacity_value" or column.removeprefix("weights_") != column or column in GAZE_VIEW


def _aoi_rows(fact: Aois) -> Iterator[Row]:
    """Yield a row for each AOI that a message names."""
    for aoi in fact.aois:
        edges: list[float | None] = [*aoi.rectangle] or [None] * 4
        corners = zip(aoi.polygon_x, aoi.polygon_y, strict=True)
        yield {
            "stamp_utc": fact.stamp.ns, "source": fact.source, "seq": fact.seq, "segment": fact.segment,
            "outcome": fact.outcome, "t_s": fact.t, "name": aoi.name, "visible": aoi.visible,
            **dict(zip(("left", "top", "right", "bottom"), edges, strict=True)),
            "polygon": ", ".join(f"{x!r} {y!r}" for x, y in corners) or None,
        }  # fmt: skip


@dataclass
class RecordingRows:
    """The rows of one recording, made from its facts in their order.

    Decisions are returned at the end (:meth:`rest`), since their observations and performances may come later.
    """

    file: str
    session: Session | None = None
    study: Study | None = None
    """The study of the first configuration."""
    _last: Session | None = None
    _decisions: list[Decision] = field(default_factory=list)
    _performances: dict[str, Row] = field(default_factory=dict)
    _observed: dict[int, Row] = field(default_factory=dict)

    def keys(self) -> Row:
        """Return the columns with which every row begins."""
        session = self.session
        if session is None:
            return {"session": None, "participant": None, "condition": None}
        return {"session": session.session, "participant": session.participant, "condition": session.condition}

    def rows(self, recorded: RecordedFact) -> Iterator[tuple[str, Row]]:
        """Yield the rows of a fact, each with its table. Gaze is read by ``gaze_samples``, many chunks at once."""
        fact = recorded.fact
        if isinstance(fact, Session):
            self.session = self.session or fact
            self._last = fact
            return
        if isinstance(fact, Config):
            self.study = self.study or study_from_json(fact.study)
            return
        table = TABLE_OF.get(fact.subject)
        if table is None:
            return
        if isinstance(fact, Decision):
            self._decisions.append(fact)
            return
        if isinstance(fact, Aois):
            same = {**self.keys(), "session_s": self._session_s(fact.stamp.ns)}
            yield from ((table, {**same, **row}) for row in _aoi_rows(fact))
            return
        values = values_of(fact)
        if isinstance(fact, Observation):
            self._observed[fact.version] = values
        if isinstance(fact, Performance):
            self._performances[fact.decision_id] = {name: values[name] for name in RESULT}
        yield table, {**self.keys(), "session_s": self._session_s(fact.stamp.ns), **values}

    def rest(self, complete: bool, reason: str, covariates: Mapping[str, str]) -> Iterator[tuple[str, Row]]:
        """Yield the rows of the decisions, and the one of the session."""
        for fact in sorted(self._decisions, key=lambda d: d.n):
            observed = self._observed.get(fact.versions.observation, {})
            partner = {name: value for name, value in observed.items() if _is_partner(name)}
            result = self._performances.get(fact.decision_id, {})
            time = {"session_s": self._session_s(fact.stamp.ns), "action": 1 + fact.actions.index(fact.strategy)}
            yield "decisions", {**self.keys(), **time, **values_of(fact), **partner, **result}
        first, last = self.session, self._last
        if first is None or last is None:
            return
        values = {n: v for n, v in values_of(last).items() if not n.startswith(("counts", "covariates"))}
        values |= {"stamp_utc": first.stamp.ns, "warnings": " | ".join(first.warnings)}
        duration = (last.ended.ns - last.started.ns) / NS if last.ended is not None else None
        about = {"file": self.file, "complete": complete, "incomplete_reason": reason, "duration_s": duration}
        yield "sessions", {**values, **self.keys(), **covariates, **about}

    def _session_s(self, ns: int) -> float | None:
        return (ns - self.session.started.ns) / NS if self.session is not None else None
