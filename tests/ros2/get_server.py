"""Answers one key on the mesh's bus at once: what one Zenoh request costs by itself."""

import asyncio
import sys

from shift_runtime.zenoh_bus import ZenohBus


async def main():
    bus = await ZenohBus.open(sys.argv[1], "tcp/127.0.0.1:0")
    bus.serve("bench/get", lambda request: request.reply(b"x" * 1000))
    await asyncio.sleep(3600)


asyncio.run(main())
