"""The wire of ``rmw_zenoh``: keys, liveliness tokens, QoS, attachments, type hashes. Pure.

Sources: measured with ``rmw_zenoh_cpp`` and Kilted's nodes; hashes from ``share/*/{msg,srv}/*.json`` of
ROS. Its design page is outdated on the attachment: it is 33 bytes, and what lacks it is dropped.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from hashlib import blake2b
from typing import Literal

from shift_schemas.errors import MalformedMessage, shorten

NO_HASH = "TypeHashNotSupported"
"""What Humble writes where the others write a type's hash."""
WITHOUT_HASHES = frozenset({"foxy", "galactic", "humble"})
"""Distributions that know no type hashes; Iron brought them."""
Kind = Literal["NN", "MP", "MS", "SS", "SC"]
"""Node, message publisher, message subscription, service server, service client."""
DEFAULT_DEPTH = 42
"""A depth that the token leaves out."""
GID_BYTES = 16
_ATTACHMENT = struct.Struct("<qqB16s")


@dataclass(frozen=True)
class RosType:
    """A ROS type, and its hash (REP-2011)."""

    name: str
    hash: str

    @property
    def dds(self) -> str:
        """``std_msgs/msg/String`` -> ``std_msgs::msg::dds_::String_``."""
        package, kind, name = self.name.split("/")
        return f"{package}::{kind}::dds_::{name}_"

    def hash_in(self, distribution: str) -> str:
        """What a publisher of this distribution writes."""
        return NO_HASH if distribution in WITHOUT_HASHES else self.hash

    def fits(self, written: str) -> bool:
        """Whether a peer that wrote this hash means this type. An empty hash of ours fits all."""
        return not self.hash or written in (self.hash, NO_HASH)


STRING = RosType(
    "std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
)  # fmt: skip
TRIGGER = RosType(
    "std_srvs/srv/Trigger", "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
)  # fmt: skip


def data_key(domain: int, name: str, kind: RosType, written_hash: str) -> str:
    """Where a topic's samples or a service's requests go; ``*`` for the hash hears every distribution."""
    return f"{domain}/{name.strip('/')}/{kind.dds}/{written_hash}"


def hash_of(key: str) -> str:
    """The hash in a key."""
    return key.rsplit("/", 1)[-1]


def qos_text(reliable: bool, depth: int) -> str:
    """QoS as tokens have it: volatile, keep last; fields are empty where they are the default."""
    return f"{'' if reliable else 2}::,{'' if depth == DEFAULT_DEPTH else depth}:,:,:,,"


@dataclass(frozen=True)
class Node:
    """A node in the graph. ``zid`` is the Zenoh session's id, ``nid`` the node's within it."""

    domain: int
    zid: str
    nid: int
    namespace: str
    name: str
    enclave: str = ""

    def token(self) -> str:
        """The token that shows the node."""
        return self._token(self.nid, "NN")

    def entity_token(self, entity: int, kind: Kind, topic: str, of: RosType, written_hash: str, qos: str) -> str:
        """The token that shows one of its publishers, subscriptions or services."""
        return f"{self._token(entity, kind)}/{_mangled(topic)}/{of.dds}/{written_hash}/{qos}"

    def _token(self, entity: int, kind: Kind) -> str:
        place = f"{_mangled(self.enclave or '/')}/{_mangled(self.namespace or '/')}/{self.name}"
        return f"@ros2_lv/{self.domain}/{self.zid}/{self.nid}/{entity}/{kind}/{place}"


def _mangled(name: str) -> str:
    return name.replace("/", "%")


@dataclass(frozen=True)
class Attachment:
    """What goes with each sample, request and reply; a reply repeats its request's sequence and gid."""

    sequence: int
    stamp_ns: int
    gid: bytes

    def encode(self) -> bytes:
        """33 bytes."""
        return _ATTACHMENT.pack(self.sequence, self.stamp_ns, GID_BYTES, self.gid)

    @classmethod
    def decode(cls, data: bytes) -> Attachment:
        """The inverse. Raises :class:`MalformedMessage`."""
        if len(data) != _ATTACHMENT.size:
            raise MalformedMessage(
                f"attachment: {len(data)} bytes: rmw_zenoh sends {_ATTACHMENT.size} with each sample"
            )
        sequence, stamp_ns, length, gid = _ATTACHMENT.unpack(data)
        if length != GID_BYTES:
            raise MalformedMessage(f"attachment: gid of {shorten(length)} bytes: it has {GID_BYTES}")
        return cls(sequence, stamp_ns, gid)

    def name(self) -> str:
        """An id for what it came with: the same request gets the same decision, should it come twice."""
        return f"ros-{blake2b(self.encode(), digest_size=12).hexdigest()}"


def gid_of(token: str) -> bytes:
    """A gid for an entity: 16 bytes that depend on its token alone, as in ``rmw_zenoh`` (which uses another hash)."""
    return blake2b(token.encode(), digest_size=GID_BYTES).digest()
