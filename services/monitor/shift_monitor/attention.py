"""Attention weights, focus shift and the gaze class (paper, section III-A2). Pure.

The paper applies its equations once per step. Here they are applied in proportion to dwell: d seconds on
a target are d / ``step_s`` applications, so neither the tracker's rate nor the cut of chunks matters.
Targets are indices of the study's AOIs, ``NOWHERE`` is none of them.
"""

from __future__ import annotations

from typing import NamedTuple

from shift_model.vocabulary import GazeClass
from shift_schemas.timestamps import NS
from shift_study.study import AttentionSettings

from shift_monitor.areas import NOWHERE

MARGIN = 1e-9
"""Chosen: a value this close to a threshold is at it (MODEL.md)."""

TOTAL = 1.0
"""What the weights sum to, the paper's C_max; chosen."""


class Attention(NamedTuple):
    """What gaze has left behind."""

    weights: tuple[float, ...]
    """One per AOI, in the study's order."""
    focus_shift: float = 0.0
    held: int = NOWHERE
    """The held target."""
    run_target: int = NOWHERE
    """What gaze has been on without a break lately; it becomes the held target after a while."""
    run_ns: int = 0
    """For how long that was."""
    until_ns: int | None = None
    """Where the last dwell ended, source clock; none: nothing to be continued."""
    met: bool = False
    """Whether a valid sample fell on an AOI yet."""
    dwell_ns: int = 0
    """Dwell on AOIs in this session."""


class Dwell(NamedTuple):
    """Gaze on one target from ``start_ns`` on for ``duration_ns``."""

    target: int
    start_ns: int
    duration_ns: int


def fresh(aois: int) -> Attention:
    """The start of a session: uniform weights, nothing held."""
    return Attention((TOTAL / aois,) * aois)


def dwelt(attention: Attention, dwell: Dwell, hold_ns: int, gap_ns: int, settings: AttentionSettings) -> Attention:
    """What a dwell leaves: weights, held target and focus shift.

    Another target becomes the held one when gaze has been on it for ``hold_ns`` without a break, that is
    without dwell on anything else and without a pause longer than ``gap_ns``. What is beyond counts as held.
    """
    target, start_ns, duration_ns = dwell.target, dwell.start_ns, dwell.duration_ns
    whole = (
        target == attention.run_target and attention.until_ns is not None and start_ns - attention.until_ns <= gap_ns
    )
    run_ns = (attention.run_ns if whole else 0) + duration_ns
    held, shift, held_ns = attention.held, attention.focus_shift, duration_ns
    if target != held:
        held_ns = run_ns - hold_ns
        if held_ns >= 0:
            shift = _shifted(shift, held, settings)
            held = target
    weights, dwell_ns = attention.weights, attention.dwell_ns
    if target != NOWHERE:
        dwell_ns += duration_ns
        applications = duration_ns / NS / settings.step_s
        weights = weights_after(weights, target, settings.weight_step * applications, settings.weight_min)
        if target == held:
            shift = max(shift - settings.shift_decrease * (held_ns / NS / settings.step_s), 0.0)
    return Attention(
        weights, shift, held, target, min(run_ns, hold_ns), start_ns + duration_ns, attention.met, dwell_ns
    )  # fmt: skip


def weights_after(weights: tuple[float, ...], target: int, gain: float, weight_min: float) -> tuple[float, ...]:
    """The paper's equation (w'), with what it leaves open at the floor.

    The fixated one gains ``gain``, at most up to ``TOTAL``, in equal parts from the others; one that
    reaches ``weight_min`` gives no more and the rest is taken from those above it. The fixated one gets
    what the others leave, so the sum cannot drift. A single AOI keeps everything.
    """
    after = list(weights)
    after[target] = weight_min  # gives nothing
    givers = [i for i, w in enumerate(after) if w > weight_min]
    while givers and gain > 0.0:
        least = min([after[i] for i in givers]) - weight_min
        part = gain / len(givers)
        if part < least:
            for i in givers:
                after[i] -= part
            break
        gain -= least * len(givers)
        for i in givers:
            after[i] = max(after[i] - least, weight_min)
        givers = [i for i in givers if after[i] > weight_min]
    after[target] = 0.0
    after[target] = TOTAL - sum(after)
    return tuple(after)


def gaze_class(attention: Attention, settings: AttentionSettings) -> GazeClass:
    """Fixed thresholds on the largest weight and the focus shift (paper, III-A2; the values are chosen).

    Uncertain before the first valid sample on an AOI, and until ``minimum_dwell_s`` of dwell on AOIs.
    """
    dominance, shift = max(attention.weights), attention.focus_shift
    if not attention.met or attention.dwell_ns < round(settings.minimum_dwell_s * NS):
        return "uncertain"
    if dominance >= settings.focused_dominance - MARGIN and shift <= settings.focused_shift + MARGIN:
        return "focused"
    if dominance < settings.distracted_dominance - MARGIN or shift >= settings.distracted_shift - MARGIN:
        return "distracted"
    return "uncertain"


def met_aoi(attention: Attention) -> Attention:
    """The same, once a valid sample has fallen on an AOI."""
    a = attention
    return Attention(a.weights, a.focus_shift, a.held, a.run_target, a.run_ns, a.until_ns, True, a.dwell_ns)


def interrupted(attention: Attention) -> Attention:
    """The same before another source's clock: what was not held long enough yet is forgotten."""
    return Attention(
        attention.weights, attention.focus_shift, attention.held, met=attention.met, dwell_ns=attention.dwell_ns
    )


def _shifted(shift: float, held: int, settings: AttentionSettings) -> float:
    """The focus shift after a change of target; none for the first one and the return from none."""
    return shift if held == NOWHERE else min(shift + settings.shift_increase, 1.0)
