"""A study in the form and the units that the monitor's fold needs. Pure."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE, Area, area_of
from shift_study.loading import study_from_json
from shift_study.study import Study

from shift_monitor.fixation import FixationRule, rule_of


class PreparedStudy(NamedTuple):
    """A study, prepared for the fold."""

    study: Study
    names: tuple[str, ...]
    """The names of the AOIs, in the study's order."""
    targets: dict[str | None, int]
    """The index of each AOI by its name; None is no AOI."""
    areas: tuple[Area, ...]
    rule: FixationRule
    longest_ns: int
    """The longest time that an AOI name stands for."""


@lru_cache(maxsize=256)
def prepare_study(text: str) -> PreparedStudy:
    """Return the prepared study of a ``config`` fact; it is cached, since most messages have the same study."""
    study = study_from_json(text)
    names = study.aoi_names
    targets: dict[str | None, int] = {None: NOWHERE} | {name: i for i, name in enumerate(names)}
    longest_ns = round(study.attention.maximum_dwell_s * NS)
    return PreparedStudy(study, names, targets, tuple(map(area_of, study.aois)), rule_of(study.fixation), longest_ns)


def name_of(prepared: PreparedStudy, target: int) -> str:
    """Return the name of the AOI with this index; no AOI has the empty name."""
    return "" if target == NOWHERE else prepared.names[target]
