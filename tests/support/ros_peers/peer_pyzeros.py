"""pyzeros as a peer: an independent implementation of rmw_zenoh."""

import asyncio
import sys
import threading

import pyzeros
from peer_base import PeerBase, drive
from pyzeros.sub import RawSub
from pyzeros_session import open_session
from ros2_pyterfaces.cydr.std_msgs.msg import String
from ros2_pyterfaces.cydr.std_srvs.srv import Trigger


class Peer(PeerBase):
    def __init__(self, router):
        super().__init__()
        self.session = open_session(router)
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        self.node = pyzeros.Node("pyzeros_robot", session=self.session)
        String.deserialize(String(data=b"").serialize())  # its codecs are compiled at their first use
        Trigger.Response.deserialize(Trigger.Response(success=True, message=b"").serialize())
        Trigger.Request().serialize()

    def _publisher(self, topic):
        publisher = pyzeros.Pub(String, topic, session=self.node, scope=None)
        return lambda text: publisher.publish(String(data=text.encode()))

    def _subscribe(self, topic, heard):
        RawSub(
            String, topic, lambda s: heard(String.deserialize(s.payload.to_bytes()).data.decode()),
            session=self.node, scope=None,
        )  # fmt: skip

    def _client(self, name):
        async def make():
            client = pyzeros.Client(Trigger, name, session=self.node, scope=None)
            await asyncio.wait_for(client.wait_for_service(), 20)
            return client

        return asyncio.run_coroutine_threadsafe(make(), self.loop).result()

    def _call(self, client, wait_s):
        async def call():
            return await asyncio.wait_for(client.call_async(Trigger.Request()), wait_s)

        try:
            response = asyncio.run_coroutine_threadsafe(call(), self.loop).result()
        except TimeoutError:
            return None
        return [bool(response.success), response.message.decode()]

    def ready(self, name):
        return bool(self.clients[name].zenoh_cli.matching_status.matching)

    def tokens(self):
        return sorted(str(r.ok.key_expr) for r in self.session.liveliness().get("@ros2_lv/**", timeout=2) if r.ok)


drive(Peer(sys.argv[1]))
