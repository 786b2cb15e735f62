"""Visual attention of one partner: what each dwell changes (paper, section III-A2). Pure.

The equations are in ``shift_model.attention``. The paper applies them once per step. Here they are applied in
proportion to dwell: d seconds on a target are d / ``step_s`` applications, so neither the tracker's rate nor the
cut of chunks changes the result. Targets are indices of the study's AOIs; ``NOWHERE`` stands for no AOI.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from shift_model import attention as equations
from shift_model.attention import lowered_focus_shift, next_weights, raised_focus_shift, uniform_weights
from shift_model.vocabulary import GazeClass
from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE
from shift_study.constants import AttentionSettings


class Attention(NamedTuple):
    """The attention of one partner after all gaze so far."""

    weights: tuple[float, ...]
    """One for each AOI, in the study's order."""
    focus_shift: float = 0.0
    held: int = NOWHERE
    """The held target."""
    run_target: int = NOWHERE
    """The target of the latest gaze without a break; it becomes the held target after a while."""
    run_ns: int = 0
    """The duration of that gaze."""
    until_ns: int | None = None
    """The end of the last dwell on the source's clock; None if there is no dwell to continue."""
    aoi_seen: bool = False
    """Whether a valid sample has fallen on an AOI."""
    dwell_ns: int = 0
    """Dwell on AOIs in this session."""


class Dwell(NamedTuple):
    """Gaze on one target that starts at ``start_ns`` and lasts ``duration_ns``."""

    target: int
    start_ns: int
    duration_ns: int


def initial_attention(aois: int) -> Attention:
    """Return the attention at the start of a session: uniform weights and no held target."""
    return Attention(uniform_weights(aois))


def apply_dwells(
    attention: Attention, dwells: Iterable[Dwell], hold_ns: int, gap_ns: int, settings: AttentionSettings
) -> Attention:
    """Return the attention after dwells, one after another: weights, held target and focus shift.

    Parameters
    ----------
    hold_ns
        Another target becomes the held one when gaze has been on it for this long without a break, that is without
        dwell on anything else and without a pause longer than ``gap_ns``. The time beyond counts as held.
    """
    weights, shift, held, run_target, run_ns, until_ns, aoi_seen, dwell_ns = attention
    step_s, weight_step, weight_min = settings.step_s, settings.weight_step, settings.weight_min
    decrease = settings.shift_decrease
    for target, start_ns, duration_ns in dwells:
        if target != run_target or until_ns is None or start_ns - until_ns > gap_ns:
            run_ns = 0
        run_ns += duration_ns
        held_ns = duration_ns
        if target != held:
            held_ns = run_ns - hold_ns
            if held_ns >= 0:
                shift = _shift_after_change(shift, held, settings)
                held = target
        if target != NOWHERE:
            dwell_ns += duration_ns
            weights = next_weights(weights, target, weight_step * (duration_ns / NS / step_s), weight_min)
            if target == held:
                shift = lowered_focus_shift(shift, decrease * (held_ns / NS / step_s))
        run_target, until_ns = target, start_ns + duration_ns
        if run_ns > hold_ns:
            run_ns = hold_ns
    return Attention(weights, shift, held, run_target, run_ns, until_ns, aoi_seen, dwell_ns)


def apply_dwell(
    attention: Attention, dwell: Dwell, hold_ns: int, gap_ns: int, settings: AttentionSettings
) -> Attention:
    """Return the attention after one dwell; see :func:`apply_dwells`."""
    return apply_dwells(attention, (dwell,), hold_ns, gap_ns, settings)


def gaze_class(attention: Attention, settings: AttentionSettings) -> GazeClass:
    """Return the gaze class by the study's thresholds.

    The class is *uncertain* until a valid sample has fallen on an AOI and ``minimum_dwell_s`` of dwell is reached.
    """
    if not attention.aoi_seen or attention.dwell_ns < round(settings.minimum_dwell_s * NS):
        return "uncertain"
    return equations.gaze_class(
        max(attention.weights),
        attention.focus_shift,
        focused_dominance=settings.focused_dominance,
        focused_shift=settings.focused_shift,
        distracted_dominance=settings.distracted_dominance,
        distracted_shift=settings.distracted_shift,
    )


def mark_aoi_seen(attention: Attention) -> Attention:
    """Return the attention once a valid sample has fallen on an AOI."""
    a = attention
    return Attention(a.weights, a.focus_shift, a.held, a.run_target, a.run_ns, a.until_ns, True, a.dwell_ns)


def forget_run(attention: Attention) -> Attention:
    """Return the attention before another source's clock: gaze that was not held long enough is forgotten."""
    return Attention(
        attention.weights,
        attention.focus_shift,
        attention.held,
        aoi_seen=attention.aoi_seen,
        dwell_ns=attention.dwell_ns,
    )


def _shift_after_change(shift: float, held: int, settings: AttentionSettings) -> float:
    """Return the focus shift after a change of target; the first target and the return from none change nothing."""
    return shift if held == NOWHERE else raised_focus_shift(shift, settings.shift_increase)
