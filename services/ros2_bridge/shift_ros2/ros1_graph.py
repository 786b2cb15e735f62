"""The graph of a ROS 1 master, and how it is made again after the master was restarted.

A master keeps its graph in memory only, and most nodes register once. So the bridge notes who talks to it, and tells a
new master of itself and of those of them that still live: otherwise a node that joins later would not find them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy

OK = 1
Role = Literal["publisher", "subscriber"]


@dataclass(frozen=True)
class Registration:
    """A publisher or subscriber of a topic. ``node_uri`` is the address of the node that it belongs to."""

    role: Role
    topic: str
    kind: str
    node: str
    node_uri: str


def registrations_of(node: str, uri: str) -> list[Registration]:
    """Return what a node says of itself."""
    api: Any = ServerProxy(uri)
    return [
        *(Registration("publisher", topic, kind, node, uri) for topic, kind in api.getPublications(node)[2]),
        *(Registration("subscriber", topic, kind, node, uri) for topic, kind in api.getSubscriptions(node)[2]),
    ]


def registrations_on(master: Any, topics: Iterable[str], without: str) -> list[Registration]:
    """Return who publishes and subscribes to topics, without one node. ``master`` is a ``rosgraph.Master``."""
    wanted = set(topics)
    kinds = dict(master.getTopicTypes())
    publishers, subscribers, _ = master.getSystemState()
    roles: dict[Role, Any] = {"publisher": publishers, "subscriber": subscribers}
    named = [
        (role, topic, node) for role, of in roles.items() for topic, nodes in of for node in nodes if topic in wanted
    ]
    uris = {node: master.lookupNode(node) for node in {node for _, _, node in named} - {without}}
    return [
        Registration(role, topic, kinds.get(topic, "*"), node, uris[node])
        for role, topic, node in named
        if node in uris
    ]


def register_again(master_uri: str, registrations: Iterable[Registration]) -> list[str]:
    """Tell a master of registrations, each in the name of its node, if the node lives; return the nodes.

    Each subscriber is told who publishes there, as the master does when a node registers itself.
    """
    master: Any = ServerProxy(master_uri)
    registered = dict[str, None]()
    for r in registrations:
        node: Any = ServerProxy(r.node_uri)
        try:
            if node.getPid(r.node)[0] != OK:
                continue
            if r.role == "publisher":
                master.registerPublisher(r.node, r.topic, r.kind, r.node_uri)
            else:
                publishers = master.registerSubscriber(r.node, r.topic, r.kind, r.node_uri)[2]
                node.publisherUpdate("/master", r.topic, publishers)
        except (OSError, XmlRpcError):
            continue  # the node is gone, or the master is again; the next turn looks
        registered[r.node] = None
    return list(registered)
