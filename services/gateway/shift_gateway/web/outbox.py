"""One request to an owner's outbox: the facts of a session after a sequence number, and how far the owner has read."""

from __future__ import annotations

from shift_runtime.bus.protocol import Bus, Reply, first_answer
from shift_runtime.reader import PULL_TIMEOUT_S
from shift_schemas.codec import decode, encode
from shift_schemas.errors import MalformedMessage, Unavailable
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import OutboxPage, OutboxQuery


async def outbox_page(bus: Bus, owner: str, query: OutboxQuery) -> OutboxPage:
    """Return the owner's answer. Raise :class:`Unavailable` if it does not answer."""
    key = build_key(ServiceKey(owner, "outbox"))
    page = await first_answer(bus, key, encode(query), timeout_s=PULL_TIMEOUT_S, read=_page_of)
    if page is None:
        raise Unavailable(f"the {owner} does not answer")
    return page


def _page_of(reply: Reply) -> OutboxPage | None:
    try:
        return decode(OutboxPage, reply.payload) if reply.ok else None
    except MalformedMessage:
        return None
