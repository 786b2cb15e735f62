"""A chunk of points folded at once, compared with the fold sample by sample to the last bit."""

from __future__ import annotations

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_monitor.attention import Attention, initial_attention
from shift_monitor.fixation import EndedFixation
from shift_monitor.gaze_stream import GazeStream, apply_points
from shift_monitor.prepared_study import PreparedStudy, prepare_study
from shift_schemas.messages import GazeChunk
from shift_schemas.timestamps import NS
from shift_study.area_geometry import Area
from shift_study.loading import study_json
from shift_study.moving_areas import AreasOverTime, Layout
from support import slow_gaze
from support.monitor_sessions import RECORDINGS, recording, study

AREAS = [
    {"name": "cup", "rectangle": [0.1, 0.1, 0.5, 0.6]},
    {"name": "table", "polygon": [[0.0, 0.5], [1.0, 0.4], [1.0, 1.0], [0.0, 1.0]]},
    {"name": "robot", "rectangle": [0.6, 0.0, 1.0, 0.5]},
]
STUDIES = [
    prepare_study(study_json(study(aois=AREAS))),
    prepare_study(study_json(study(aois=AREAS, fixation={"dispersion_deg": 0.4, "minimum_duration_s": 0.03}))),
    prepare_study(study_json(study(aois=AREAS, fixation={"median_filter_s": 0, "maximum_gap_s": 0.02}))),
]
Folded = tuple[GazeStream, Attention, list[EndedFixation]]


def wandering(seed: int, samples: int, rate_hz: float, loss: float) -> GazeChunk:
    """Return points that rest, move and jump, with lost samples and gaps, as one chunk."""
    rng = random.Random(seed)
    t, x, y = 0.0, 0.5, 0.5
    columns: tuple[list[float], list[float | None], list[float | None]] = ([], [], [])
    for _ in range(samples):
        t += 1 / rate_hz * (1 if rng.random() > 0.01 else rng.choice([2, 10, 60 * rate_hz + 1]))
        if rng.random() < 0.02:
            x, y = rng.uniform(-0.3, 1.3), rng.uniform(-0.3, 1.3)
        lost = rng.random() < loss
        columns[0].append(t)
        columns[1].append(None if lost else x + rng.gauss(0, 0.004))
        columns[2].append(None if lost else y + rng.choice([0.0, rng.gauss(0, 0.004)]))
    return GazeChunk(source="eyes", seq=0, t=columns[0], x=columns[1], y=columns[2])


def pieces(chunk: GazeChunk, sizes: list[int]) -> list[GazeChunk]:
    """Return the chunk cut into pieces of these sizes, again and again."""
    assert chunk.x is not None
    assert chunk.y is not None
    cuts = [0]
    while cuts[-1] < len(chunk.t):
        cuts.append(cuts[-1] + sizes[len(cuts) % len(sizes)])
    return [
        GazeChunk(source="eyes", seq=n, t=chunk.t[a:b], x=chunk.x[a:b], y=chunk.y[a:b])
        for n, (a, b) in enumerate(pairwise(cuts))
    ]


def fold_fast(onto: Folded, chunk: GazeChunk, prepared: PreparedStudy, areas: AreasOverTime | None = None) -> Folded:
    times = [round(t * NS) for t in chunk.t]
    stream, attention, found = apply_points(
        onto[0], onto[1], times, chunk, prepared, areas or AreasOverTime(prepared.areas)
    )
    return stream, attention, [*onto[2], *found]


def fold_slowly(onto: Folded, chunk: GazeChunk, prepared: PreparedStudy, areas: AreasOverTime | None = None) -> Folded:
    times = [round(t * NS) for t in chunk.t]
    stream, attention, found = slow_gaze.apply_points(
        onto[0], onto[1], times, chunk, prepared, areas or AreasOverTime(prepared.areas)
    )
    return stream, attention, [*onto[2], *found]


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rate_hz=st.sampled_from([25.0, 60.0, 120.0, 300.0, 1200.0, 20_000.0]),
    loss=st.sampled_from([0.0, 0.05, 0.5]),
    sizes=st.lists(st.integers(1, 40), min_size=1, max_size=5),
    changes=st.lists(st.sampled_from(STUDIES), min_size=1, max_size=3),
)
def test_chunk_gives_what_its_samples_give_one_by_one(
    seed: int, rate_hz: float, loss: float, sizes: list[int], changes: list[PreparedStudy]
) -> None:
    fast: Folded = GazeStream("eyes"), initial_attention(len(AREAS)), []
    slow = fast
    chunks = pieces(wandering(seed, 400, rate_hz, loss), sizes)
    for i, chunk in enumerate(chunks):
        prepared = changes[i * len(changes) // len(chunks)]
        fast, slow = fold_fast(fast, chunk, prepared), fold_slowly(slow, chunk, prepared)
        assert fast == slow


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rate_hz=st.sampled_from([60.0, 300.0]),
    sizes=st.lists(st.integers(1, 40), min_size=1, max_size=5),
)
def test_moving_areas_are_those_of_each_sample(seed: int, rate_hz: float, sizes: list[int]) -> None:
    rng, prepared = random.Random(seed), STUDIES[0]
    layouts = []
    for n in range(60):
        left, top = rng.uniform(-0.2, 0.8), rng.uniform(-0.2, 0.8)
        moving = Area(left, top, left + 0.4, top + 0.4)
        layouts.append(Layout(round(n / 30 * NS), (moving, *prepared.areas[1:])))
    areas = AreasOverTime(prepared.areas, tuple(layouts))
    fast: Folded = GazeStream("eyes"), initial_attention(len(AREAS)), []
    slow = fast
    for chunk in pieces(wandering(seed, 400, rate_hz, 0.02), sizes):
        fast, slow = fold_fast(fast, chunk, prepared, areas), fold_slowly(slow, chunk, prepared, areas)
        assert fast == slow


@pytest.mark.parametrize("path", RECORDINGS, ids=lambda p: p.stem)
def test_recording_gives_what_its_samples_give_one_by_one(path: object) -> None:
    samples = recording(path)  # type: ignore[arg-type]
    whole = GazeChunk(
        source="eyes", seq=0, t=[s.t for s in samples], x=[s.x if s.valid else None for s in samples],
        y=[s.y if s.valid else None for s in samples],
    )  # fmt: skip
    start: Folded = GazeStream("eyes"), initial_attention(len(AREAS)), []
    slow = fold_slowly(start, whole, STUDIES[0])
    fast = start
    for chunk in pieces(whole, [10]):
        fast = fold_fast(fast, chunk, STUDIES[0])
    assert fast == slow
    assert fast[2], "the recording has fixations"
