"""The share of valid samples in the last two seconds is that of a naive count, however the chunks are cut."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from shift_monitor.recent_samples import NO_SAMPLES, STEP_NS, STEPS, count_recent, valid_share


def test_without_samples_there_is_no_share() -> None:
    assert valid_share(NO_SAMPLES) is None


@given(
    spacings=st.lists(st.integers(1, 3 * STEP_NS), min_size=1, max_size=120),
    start=st.integers(-(10**12), 10**12),
    data=st.data(),
)
def test_share_is_that_of_a_naive_count(spacings: list[int], start: int, data: st.DataObject) -> None:
    times = [start]
    for spacing in spacings:
        times.append(times[-1] + spacing)
    valid = data.draw(st.lists(st.booleans(), min_size=len(times), max_size=len(times)))
    cut = data.draw(st.integers(0, len(times)))
    recent = count_recent(NO_SAMPLES, times[:cut], valid[:cut])
    recent = count_recent(recent, times[cut:], valid[cut:])
    newest = times[-1] // STEP_NS
    kept = [ok for t, ok in zip(times, valid, strict=True) if t // STEP_NS > newest - STEPS]
    assert valid_share(recent) == sum(kept) / len(kept)
    assert len(recent.counts) <= STEPS
