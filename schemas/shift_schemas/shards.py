"""Shards: a mesh can run several workers of each service, and a session belongs to the shard to which its id hashes.

A shard is a complete set of services with journals and Zenoh keys of its own. Nothing ever moves from one shard to
another, so that no coordinator is needed. Pure.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass

MOST_SHARDS = 1024
_WRITTEN = re.compile(r"(\d{1,4})/(\d{1,4})")


@dataclass(frozen=True)
class Shard:
    """One of ``count`` shards, numbered from 0. It is written ``0/4``."""

    index: int = 0
    count: int = 1

    def __post_init__(self) -> None:
        """Check the numbers. Raise ``ValueError``."""
        if not 1 <= self.count <= MOST_SHARDS:
            raise ValueError(f"write a number of shards from 1 to {MOST_SHARDS}, not {self.count}")
        if not 0 <= self.index < self.count:
            raise ValueError(f"{self.count} shards have the numbers 0 to {self.count - 1}, not {self.index}")

    def __str__(self) -> str:
        """Return the shard as the settings write it."""
        return f"{self.index}/{self.count}"

    @property
    def name(self) -> str:
        """The name in keys and folders, such as ``shard-0-of-4``; empty if there is only one shard."""
        return f"shard-{self.index}-of-{self.count}" if self.count > 1 else ""

    def holds(self, session: str) -> bool:
        """Return whether a session belongs to this shard."""
        return shard_of(session, self.count) == self.index


def parse_shard(text: str) -> Shard:
    """Return the shard that ``text`` spells, such as ``0/4``. Raise ``ValueError`` for anything else."""
    match = _WRITTEN.fullmatch(text.strip())
    if match is None:
        raise ValueError("write the shard's number, from 0, and the number of shards: 0/4")
    return Shard(int(match[1]), int(match[2]))


def every_shard(count: int) -> tuple[Shard, ...]:
    """Return all shards of a mesh with ``count`` of them."""
    return tuple(Shard(index, count) for index in range(count))


def shard_of(session: str, count: int) -> int:
    """Return the number of the shard to which a session belongs: SHA-256 of its id, the first 8 bytes, modulo count."""
    if count == 1:
        return 0
    return int.from_bytes(hashlib.sha256(session.encode()).digest()[:8], "big") % count
