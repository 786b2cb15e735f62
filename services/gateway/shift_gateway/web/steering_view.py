"""The steering of a session: which merge patch an edit makes, and what it would change. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shift_schemas.errors import ShiftError
from shift_schemas.messages import Marker
from shift_study.loading import patched
from shift_study.patching import merge_patch
from shift_study.scoring_table import ScoringTable
from shift_study.study import Study

from shift_gateway.web.desk_view import state_changes
from shift_gateway.web.history import END_OF_TIME, SessionHistory

Path = tuple[str, ...]


def entries(study: Study) -> dict[Path, float]:
    """Return every weight and table entry of a study by its path, such as ``("table", "low", "negation")``."""
    found: dict[Path, float] = {("weight", name): s.weight for name, s in study.scoring.strategies.items()}
    for part in ScoringTable.model_fields:
        for category, row in getattr(study.scoring.table, part):
            found |= {("table", category, name): row[name] for name in study.scoring.strategies}
    return found


def patch_of(study: Study, edited: Mapping[Path, float]) -> dict[str, Any]:
    """Return the merge patch that gives the study the edited weights and table entries; only what differs."""
    now = entries(study)
    patch: Any = {}
    for path, value in edited.items():
        if now.get(path) != value:
            patch = merge_patch(patch, _nested(_study_path(path), value))
    return dict(patch)


def _study_path(path: Path) -> Path:
    if path[0] == "weight":
        return ("scoring", "strategies", path[1], "weight")
    part = next(p for p in ScoringTable.model_fields if path[1] in ScoringTable.model_fields[p].annotation.model_fields)  # type: ignore[union-attr]
    return ("scoring", "table", part, *path[1:])


def _nested(path: Path, value: float) -> Any:
    return {path[0]: _nested(path[1:], value)} if path else value


def preview(study: Study, edited: Mapping[Path, float]) -> list[str]:
    """Return one line for each triple whose cognitive state the edit would change, or why the edit is not possible."""
    try:
        after = patched(study, patch_of(study, edited))
    except ShiftError as e:
        return [e.detail]
    found = [change.text for change in state_changes(study, after)]
    return found or ["No triple changes its cognitive state."]


def open_decisions(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[str]:
    """Return the decisions without a result, the newest first."""
    reported = {p.decision_id for p in history.performances.until(at_ns)}
    return [d.decision_id for d in reversed(history.decisions.until(at_ns)) if d.decision_id not in reported]


def standing_markers(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[tuple[Marker, bool]]:
    """Return every marker that is not itself a retraction, and whether it is retracted; the newest first."""
    markers = history.markers.until(at_ns)
    retracted = {m.retracts for m in markers}
    return [(m, m.marker_id in retracted) for m in reversed(markers) if not m.retracts]
