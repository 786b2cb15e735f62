"""What people changed in a session, and how each change is reversed. Pure.

Changes are configurations, overrides, markers, and results that a person entered or corrected.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, Literal, NamedTuple

from shift_schemas.messages import Config, Marker, Override

from shift_gateway.web.charts import shortened
from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.scoring_edits import Path, nested
from shift_gateway.web.table_rows import Button, Cell, Row
from shift_gateway.web.wording import clock_time, levels

Action = Literal["", "undo", "withdraw", "retract"]
REVERSE = "desk-reverse"
"""The browser's event for a change that is to be reversed, with action and target: ``undo 3``."""
LONGEST = 120
"""A longer text is cut in the list, characters."""


class Change(NamedTuple):
    """One change."""

    ns: int
    kind: str
    author: str
    what: str
    now: str
    """What holds of it now."""
    action: Action = ""
    """How it can be reversed; '' is not at all."""
    target: str = ""
    """The configuration's version, the override's id or the marker's id."""


Differences = dict[Path, tuple[Any, Any]]
"""Old and new value at each path that differs; None is a value that is not set."""


def differences(before: Mapping[str, Any], after: Mapping[str, Any], under: Path = ()) -> Differences:
    """Return where two studies, as plain objects, differ."""
    found: Differences = {}
    for key in [*before, *(k for k in after if k not in before)]:
        old, new, path = before.get(key), after.get(key), (*under, key)
        if isinstance(old, dict) and isinstance(new, dict):
            found |= differences(old, new, path)
        elif old != new:
            found[path] = (old, new)
    return found


def inverse_patch(changed: Differences) -> dict[str, Any]:
    """Return the merge patch that puts the old values back."""
    return nested({path: old for path, (old, _) in changed.items()})


def undo_patch(history: SessionHistory, version: int) -> dict[str, Any] | None:
    """Return the merge patch that undoes a configuration; None if its values do not hold any more."""
    configs = history.configs.items
    index = next((i for i, c in enumerate(configs) if c.version == version and i > 0), None)
    if index is None:
        return None
    changed = differences(_study(configs[index - 1]), _study(configs[index]))
    current = _study(configs[-1])
    holds = bool(changed) and all(_value(current, path) == new for path, (_, new) in changed.items())
    return inverse_patch(changed) if holds else None


def changes(history: SessionHistory, at_ns: int = END_OF_TIME) -> list[Change]:
    """Return every change, the newest first."""
    found = [
        *_configurations(history.configs.until(at_ns)), *_overrides(history, at_ns),
        *_markers(history.markers.until(at_ns)), *_results(history, at_ns),
    ]  # fmt: skip
    return sorted(found, key=lambda change: change.ns, reverse=True)


def change_rows(found: list[Change]) -> list[Row]:
    """Return a row for each change; it has a button if the change can be reversed."""
    return [
        Row([
            clock_time(c.ns), c.author or "–", c.kind, c.what, c.now,
            Cell(button=_reversing(c)) if c.action else "",
        ])
        for c in found
    ] or [Row(["no change yet", "", "", "", "", ""])]  # fmt: skip


def _reversing(change: Change) -> Button:
    what = change.kind if change.action == "undo" else f"{change.kind} {change.target}"
    return Button(change.action, REVERSE, f"{change.action} {change.target}", f"{change.action} {what}", change.action)


def _configurations(configs: list[Config]) -> Iterator[Change]:
    current = _study(configs[-1]) if configs else {}
    for before, after in pairwise(configs):
        changed = differences(_study(before), _study(after))
        what = ", ".join(f"{'.'.join(path)} {_word(old)} → {_word(new)}" for path, (old, new) in changed.items())
        holds = bool(changed) and all(_value(current, path) == new for path, (_, new) in changed.items())
        now = "in force" if holds else "undone or changed again" if changed else "nothing changed"
        kind = f"configuration {after.version}"
        action: Action = "undo" if holds else ""
        yield Change(after.stamp.ns, kind, after.author, what or "–", now, action, str(after.version))


def _overrides(history: SessionHistory, at_ns: int) -> Iterator[Change]:
    overrides = history.overrides.until(at_ns)
    used = {d.override_id: d.n for d in history.decisions.until(at_ns) if d.override_id}
    withdrawn = {o.withdraws for o in overrides if o.withdraws}
    waiting = {o.override_id for o in history.pending_overrides(at_ns).values()}
    for o in overrides:
        if o.withdraws:
            yield Change(o.stamp.ns, "withdrawal", o.author, f"override {o.withdraws} of {o.task}", "")
            continue
        state = _override_state(o, used, withdrawn, waiting)
        reason = f" ({shortened(o.reason, LONGEST)})" if o.reason else ""
        action: Action = "withdraw" if o.override_id in waiting else ""
        what = f"{o.task}: {levels(o.strategy)}{reason}"
        yield Change(o.stamp.ns, "override", o.author, what, state, action, o.override_id)


def _override_state(override: Override, used: dict[str, int], withdrawn: set[str], waiting: set[str]) -> str:
    if override.override_id in used:
        return f"used by decision {used[override.override_id]}"
    if override.override_id in withdrawn:
        return "withdrawn"
    return "waits for the task's next decision" if override.override_id in waiting else "replaced"


def _markers(markers: list[Marker]) -> Iterator[Change]:
    texts = {m.marker_id: m.text for m in markers}
    retracted = {m.retracts for m in markers if m.retracts}
    for m in markers:
        if m.retracts:
            what = f"marker “{shortened(texts.get(m.retracts, m.retracts), LONGEST)}”"
            yield Change(m.stamp.ns, "retraction", m.author, what, "")
        else:
            gone = m.marker_id in retracted
            action: Action = "" if gone else "retract"
            state = "retracted" if gone else ""
            yield Change(m.stamp.ns, "marker", m.author, shortened(m.text, LONGEST), state, action, m.marker_id)


def _results(history: SessionHistory, at_ns: int) -> Iterator[Change]:
    """Yield the results that a person entered: those with a name, and corrections."""
    numbers = {d.decision_id: d.n for d in history.decisions.until(at_ns)}
    for p in history.performances.until(at_ns):
        if p.author or p.corrects:
            kind = "corrected result" if p.corrects else "result"
            what = f"decision {numbers.get(p.decision_id, p.decision_id)}, {p.task}: reward {p.reward:.2f}"
            yield Change(p.stamp.ns, kind, p.author, what, "")


def _study(config: Config) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(config.study)
    return found


def _value(data: Any, path: Path) -> Any:
    for key in path:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def _word(value: Any) -> str:
    return "not set" if value is None else value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
