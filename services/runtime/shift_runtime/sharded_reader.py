"""Read the services of every shard, as a gateway and a bridge do. With one shard this is one reader."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence

from shift_schemas.shards import shard_of

from shift_runtime.bus.protocol import Bus
from shift_runtime.reader import SESSION_OWNER, Reader, ReadFact


class ShardedReader:
    """One reader for each shard; ``buses`` are in the order of the shards."""

    def __init__(
        self,
        buses: Sequence[Bus],
        owners: tuple[str, ...],
        deliver: Callable[[ReadFact], None],
        dropped: Callable[[str], None],
        lost: Callable[[str], None],
    ) -> None:
        self.readers = [Reader(bus, owners, {}, deliver, dropped, closed=True, lost=lost) for bus in buses]

    def of(self, session: str) -> Reader:
        """Return the reader of the session's shard."""
        return self.readers[shard_of(session, len(self.readers))]

    def start(self) -> None:
        """Subscribe to the notifications."""
        for reader in self.readers:
            reader.start()

    async def run(self) -> None:
        """Pull every owner without end."""
        await asyncio.gather(*(reader.run() for reader in self.readers))

    @property
    def synced(self) -> set[str]:
        """Owners of which every shard was read to its end at least once."""
        return set.intersection(*(reader.synced for reader in self.readers))

    @property
    def unreached(self) -> list[str]:
        """The owners that have answered before and do not answer any more in some shard."""
        return sorted({owner for reader in self.readers for owner in reader.links.unreached})

    def silent_s(self, owner: str) -> float:
        """Return the seconds since an owner last answered, in the shard where that is longest ago."""
        return max(reader.links.silent_s(owner) for reader in self.readers)

    def cursor(self, session: str, owner: str) -> int | None:
        """Return the last sequence number that was read, or None if nothing was."""
        return self.of(session).cursors.get((session, owner))

    def read_again(self, read: ReadFact) -> None:
        """Read a fact again after its session's owner was asked."""
        reader = self.of(read.fact.session)
        reader.cursors[read.fact.session, read.owner] = read.seq - 1
        reader.pull_soon(SESSION_OWNER)

    async def pull(self, owner: str, session: str | None = None, current: bool = False) -> bool:
        """Read an owner's outbox to its end, of one session or in every shard; return whether it answered."""
        if session is not None:
            return await self.of(session).pull(owner, session, current)
        return all(await asyncio.gather(*(reader.pull(owner) for reader in self.readers)))

    async def pull_all(self, owners: Iterable[str], session: str | None = None) -> tuple[str, ...]:
        """Pull several owners; return those that did not answer."""
        owners = tuple(owners)
        if session is not None:
            return await self.of(session).pull_all(owners, session)
        silent = await asyncio.gather(*(reader.pull_all(owners) for reader in self.readers))
        return tuple(owner for owner in owners if any(owner in found for found in silent))
