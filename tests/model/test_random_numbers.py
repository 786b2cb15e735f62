"""Counter-based random numbers: scalars and arrays give the same bits, and the bits show no pattern."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shift_model.random_numbers import DECISION, pick, uniform

seeds = st.integers(0, 2**53 - 1)
numbers = st.integers(0, 2**31)
rows = st.lists(st.integers(0, 9), min_size=1, max_size=8).filter(any).map(lambda w: [x / sum(w) for x in w])


def naive(seed: int, n: int, stream: int) -> float:
    """Return the draw by SplitMix64's finalizer as published, three rounds over the address."""
    h = 0
    for word in (seed, n, stream):
        h = ((h ^ word) + 0x9E3779B97F4A7C15) % 2**64
        h = ((h ^ (h >> 30)) * 0xBF58476D1CE4E5B9) % 2**64
        h = ((h ^ (h >> 27)) * 0x94D049BB133111EB) % 2**64
        h ^= h >> 31
    return (h >> 11) / 2**53


@given(seeds, numbers, st.integers(0, 10))
def test_draw_matches_the_published_generator(seed: int, n: int, stream: int) -> None:
    assert uniform(seed, n, stream) == naive(seed, n, stream)


@given(st.lists(seeds, min_size=1, max_size=5), st.lists(numbers, min_size=1, max_size=5), st.integers(0, 3))
def test_arrays_give_the_same_bits(seed: list[int], n: list[int], stream: int) -> None:
    table = uniform(np.array(seed)[:, None], np.array(n)[None, :], stream)
    assert table.tolist() == [[uniform(s, k, stream) for k in n] for s in seed]
    assert uniform(np.array(seed), n[0], stream).tolist() == [uniform(s, n[0], stream) for s in seed]


def test_first_draws_of_a_seed_never_change() -> None:
    assert [uniform(7, n) for n in (1, 2, 3)] == [naive(7, n, DECISION) for n in (1, 2, 3)]
    assert DECISION == 0


def test_draws_are_uniform_over_decisions_and_over_seeds() -> None:
    for drawn in (uniform(np.full(100_000, 7), np.arange(100_000)), uniform(np.arange(100_000), np.ones(100_000, int))):
        assert drawn.min() >= 0
        assert drawn.max() < 1
        counts, _ = np.histogram(drawn, bins=100, range=(0, 1))
        assert ((counts - 1000) ** 2 / 1000).sum() < 150, "chi square, 99 degrees of freedom: 149.4 at p = 0.0008"


def test_draws_at_neighbouring_addresses_are_uncorrelated() -> None:
    n = np.arange(100_000)
    for a, b in (
        (uniform(np.full(100_000, 7), n), uniform(np.full(100_000, 7), n + 1)),
        (uniform(np.full(100_000, 7), n), uniform(np.full(100_000, 8), n)),
        (uniform(np.full(100_000, 7), n), uniform(np.full(100_000, 7), n, 1)),
    ):
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.02


@given(rows, st.floats(0, 1, exclude_max=True))
def test_pick_returns_the_index_where_the_running_sum_first_exceeds(row: list[float], u: float) -> None:
    found = pick(row, u)
    assert row[found] > 0
    sums = np.cumsum(row)
    above = [i for i, s in enumerate(sums) if u < s and row[i] > 0]
    assert found == (above[0] if above else max(i for i, p in enumerate(row) if p > 0))


def test_pick_at_the_borders() -> None:
    assert pick([0.0, 1.0], 0.0) == 1
    assert pick([0.5, 0.5], 0.5) == 1
    assert pick([0.5, 0.5], 0.4999) == 0
    assert pick([0.1] * 10, 1 - 2**-53) == 9
    assert pick([0.1] * 7 + [0.0], 0.99) == 6, "rounding leaves the sum below u: the last index with any probability"


@given(rows)
def test_pick_frequencies_match_the_row(row: list[float]) -> None:
    drawn = uniform(np.full(4000, 3), np.arange(4000))
    counts = np.bincount([pick(row, u) for u in drawn.tolist()], minlength=len(row))
    assert np.abs(counts / 4000 - row).max() < 0.04
