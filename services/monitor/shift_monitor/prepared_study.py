"""A study, prepared for the fold: what the monitor needs of it, in the units that it needs. Pure."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json
from shift_study.study import Study

from shift_monitor.areas import NOWHERE, Area, area_of
from shift_monitor.fixation import Rule, rule_of


class Plan(NamedTuple):
    """A study, prepared for the fold."""

    study: Study
    names: tuple[str, ...]
    targets: dict[str | None, int]
    areas: tuple[Area, ...]
    rule: Rule
    longest_ns: int
    """How long an AOI name stands at most."""


@lru_cache(maxsize=256)
def plan_of(text: str) -> Plan:
    """The study of a ``config`` fact; cached, for it is the same from message to message."""
    study = study_from_json(text)
    names = study.aoi_names
    targets: dict[str | None, int] = {None: NOWHERE} | {name: i for i, name in enumerate(names)}
    longest_ns = round(study.attention.maximum_dwell_s * NS)
    return Plan(study, names, targets, tuple(map(area_of, study.aois)), rule_of(study.fixation), longest_ns)


def name_of(plan: Plan, target: int) -> str:
    return "" if target == NOWHERE else plan.names[target]
