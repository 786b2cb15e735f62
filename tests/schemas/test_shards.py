"""Shards: how they are written, and which session belongs to which shard."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.shards import Shard, every_shard, parse_shard, shard_of


@given(st.text(), st.integers(1, 1024))
def test_each_session_belongs_to_exactly_one_shard(session: str, count: int) -> None:
    assert [shard.holds(session) for shard in every_shard(count)].count(True) == 1


def test_shard_of_a_session_never_changes() -> None:
    """The numbers are fixed: a session that moved would be lost from view."""
    assert [shard_of(session, 4) for session in ("s1", "s2", "s3", "teilnehmer-ä")] == [3, 2, 0, 0]


def test_sessions_spread_evenly() -> None:
    counts = Counter(shard_of(f"P{n:03}", 4) for n in range(4000))
    assert sorted(counts) == [0, 1, 2, 3]
    assert min(counts.values()) > 900


@given(st.integers(1, 1024).flatmap(lambda count: st.tuples(st.integers(0, count - 1), st.just(count))))
def test_what_is_written_is_read_again(numbers: tuple[int, int]) -> None:
    shard = Shard(*numbers)
    assert parse_shard(str(shard)) == shard


def test_single_shard_has_no_name_so_that_older_data_folders_stay_as_they_are() -> None:
    assert Shard().name == ""
    assert Shard(1, 4).name == "shard-1-of-4"


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("4/4", "numbers 0 to 3, not 4"), ("0/0", "from 1 to 1024, not 0"), ("1", "0/4"), ("-1/4", "0/4"),
        ("0/4/2", "0/4"), ("", "0/4"), ("0/2000", "from 1 to 1024, not 2000"),
    ],
)  # fmt: skip
def test_what_is_not_a_shard_is_refused_with_the_rule(text: str, rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        parse_shard(text)
