"""A Trigger server with nothing behind it, of pyzeros: what a round trip costs by itself."""

import asyncio
import sys

import pyzeros
from pyzeros_session import open_session
from ros2_pyterfaces.cydr.std_srvs.srv import Trigger

ANSWER = b'{"decision_id":"' + b"x" * 1000 + b'"}'


async def main():
    node = pyzeros.Node("bare", session=open_session(sys.argv[1]))
    server = pyzeros.Server(Trigger, "/bare/next_strategy", session=node, scope=None)
    async for responder in server.listen_reliable():
        responder.response.success, responder.response.message = True, ANSWER
        responder.send()


asyncio.run(main())
