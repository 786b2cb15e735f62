"""A Trigger server with nothing behind it, of the bridge's own backend: what a round trip costs by itself."""

import asyncio
import sys

from shift_ros2.service import open_backend
from shift_ros2.settings import bridge_settings

ANSWER = '{"decision_id":"' + "x" * 1000 + '"}'


class Handlers:
    async def on_request(self, request_id):
        return True, ANSWER

    def on_text(self, topic, text):
        pass

    def on_lost(self, topic, error, count=1, reason=""):
        print(topic, error, file=sys.stderr)


async def main():
    line = ["-r", "__node:=bare", "-r", "shift/next_strategy:=/bare/next_strategy", "-p", "ros4hri:=false"]
    await open_backend(bridge_settings([*sys.argv[1:], *line]), Handlers())
    await asyncio.sleep(3600)


asyncio.run(main())
