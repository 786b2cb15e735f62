"""Plans of gaze: which AOIs to look at, and for how long, so that the monitor computes a wanted gaze class.

Pure, and faster than real time: samples are AOI names on the simulator's own clock. The search applies candidate
looks to the monitor's own rules (``shift_monitor.attention``). It tries a steady look, turns between AOIs, and a
steady look after the turns. It starts from the present attention, and then from the attention after a calm look.

A chunk ends with a sample on no AOI. The last sample of a source has no dwell yet, so the next chunk adds only
``LEAD_NS`` on no AOI. That is too short to become the held target.

No gaze can reach some classes. With one AOI, the dominance is always 1 and the focus shift only falls, so the gaze
class becomes *focused* and stays so. With two AOIs, the dominance is at least 0.5, so both other classes need a rise
of the focus shift (``shift_increase`` above 0). *Focused* needs weights that change and a focus shift that falls.
If a class cannot be reached, the plan is refused with :class:`InvalidSettings`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from shift_model.vocabulary import GazeClass
from shift_monitor.attention import Attention, Dwell, apply_dwell, gaze_class
from shift_schemas.errors import InvalidSettings
from shift_schemas.messages import GazeChunk, GazeView
from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE
from shift_study.study import Study

LEAD_NS = 1_000_000
"""Time from the end of one chunk to the start of the next, ns; chosen far below the shortest fixation."""
TURNS = 48
"""Largest number of turns between AOIs; chosen above the 8 that any state needs with the default settings."""
LOOKS = 240
"""Largest number of steady looks in a row; chosen above the 20 that any state needs with the default settings."""


class Look(NamedTuple):
    """Gaze on one AOI (its index) for a duration."""

    target: int
    duration_ns: int


def plan_gaze(study: Study, view: GazeView, wanted: GazeClass) -> tuple[Look, ...]:
    """Return the looks after which the monitor's gaze class is ``wanted``; an empty tuple if it already is.

    Parameters
    ----------
    view
        The attention in the newest observation. All earlier gaze of the session must come from such plans.

    Raises
    ------
    InvalidSettings
        The class cannot be reached with this study's AOIs and attention settings.
    """
    if view.category == wanted:
        return ()
    return _search(study, _attention(study, view), wanted)


def chunk_of(study: Study, looks: tuple[Look, ...], source: str, seq: int, clock_ns: int) -> tuple[GazeChunk, int]:
    """Return the looks as a chunk that begins ``LEAD_NS`` after ``clock_ns``, and the clock at its end."""
    times, names = [], []
    now_ns = clock_ns + LEAD_NS
    longest_ns = round(study.attention.maximum_dwell_s * NS)
    for look in looks:
        for start_ns in range(0, look.duration_ns, longest_ns):
            times.append((now_ns + start_ns) / NS)
            names.append(study.aoi_names[look.target])
        now_ns += look.duration_ns
    return GazeChunk(source=source, seq=seq, t=[*times, now_ns / NS], aoi=[*names, None]), now_ns


# --- the search ---


def _search(study: Study, start: Attention, wanted: GazeClass) -> tuple[Look, ...]:
    aois = tuple(range(len(study.aois)))
    rings = (aois[:2], aois) if len(aois) > 2 else (aois,)
    for calm in (False, True):
        for ring in rings:
            for looks, attention in _candidates(study, start, ring, calm):
                if gaze_class(attention, study.attention) == wanted:
                    return looks
    raise InvalidSettings(
        f"with the attention settings of study {study.study}, no gaze on its {len(aois)} AOIs produces the gaze class "
        f"{wanted}; change the attention settings, or give the study two or more AOIs"
    )


def _candidates(
    study: Study, start: Attention, ring: tuple[int, ...], calm: bool
) -> Iterator[tuple[tuple[Look, ...], Attention]]:
    """Yield candidate looks with the attention after them: 0, 1, ... turns through ``ring``, then a steady look."""
    hold_ns, unit_ns = _hold_ns(study), _unit_ns(study)
    here = start.held if start.held != NOWHERE else start.weights.index(max(start.weights))
    looks: tuple[Look, ...] = ()
    if calm:
        looks, start = _steady(study, looks, start, here, unit_ns, LOOKS)
    for turn in range(TURNS):
        if looks:
            yield looks, start
        for steady in (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, LOOKS):
            yield _steady(study, looks, start, here, unit_ns, steady)
        here = next(a for a in (*ring[turn % len(ring) :], *ring) if a != here) if len(ring) > 1 else here
        looks, start = _steady(study, looks, start, here, hold_ns, 1)


def _steady(
    study: Study, looks: tuple[Look, ...], attention: Attention, target: int, duration_ns: int, times: int
) -> tuple[tuple[Look, ...], Attention]:
    """Add one look of ``times`` x ``duration_ns``, divided into samples as in :func:`chunk_of`."""
    whole = Look(target, duration_ns * times)
    longest_ns = round(study.attention.maximum_dwell_s * NS)
    until_ns = attention.until_ns or 0
    for start_ns in range(0, whole.duration_ns, longest_ns):
        dwell = Dwell(target, until_ns + start_ns, min(longest_ns, whole.duration_ns - start_ns))
        attention = apply_dwell(attention, dwell, _hold_ns(study), 0, study.attention)
    return (*looks, whole), attention


def _attention(study: Study, view: GazeView) -> Attention:
    """Return the attention after the time on no AOI at the start of each chunk."""
    held = study.aoi_names.index(view.aoi) if view.aoi else NOWHERE
    weights = tuple(view.weights[name] for name in study.aoi_names)
    dwell_ns = round((view.dwell_s or 0.0) * NS)
    return Attention(weights, view.focus_shift, held, NOWHERE, LEAD_NS, 0, aoi_seen=True, dwell_ns=dwell_ns)


def _hold_ns(study: Study) -> int:
    """Return the time until a look becomes the held target, rounded like the monitor's."""
    return round(study.fixation.minimum_duration_s * NS)


def _unit_ns(study: Study) -> int:
    """Return the unit of a steady look: the longer of one application of the equations and the time to be held."""
    return max(round(study.attention.step_s * NS), _hold_ns(study))
