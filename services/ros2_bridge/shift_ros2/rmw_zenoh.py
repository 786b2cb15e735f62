"""The wire format of ``rmw_zenoh``: keys, liveliness tokens, QoS, attachments and type hashes. Pure.

Sources: measurements with ``rmw_zenoh_cpp`` and nodes of Kilted; the hashes are from ``share/*/{msg,srv}/*.json`` of
ROS. The design page of ``rmw_zenoh`` is outdated: an attachment has 33 bytes, and a sample without one is dropped.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from hashlib import blake2b
from typing import Literal

from shift_schemas.errors import MalformedMessage, shorten

NO_HASH = "TypeHashNotSupported"
"""The text that Humble writes instead of a type's hash."""
WITHOUT_HASHES = frozenset({"foxy", "galactic", "humble"})
"""The distributions before Iron, which introduced type hashes."""
Kind = Literal["NN", "MP", "MS", "SS", "SC"]
"""Node, message publisher, message subscription, service server, service client."""
DEFAULT_DEPTH = 42
"""The depth that a token leaves out."""
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
        """Return the hash that a publisher of this distribution writes."""
        return NO_HASH if distribution in WITHOUT_HASHES else self.hash

    def fits(self, written: str) -> bool:
        """Return whether a peer that wrote this hash uses this type. A type of ours without a hash fits every hash."""
        return not self.hash or written in (self.hash, NO_HASH)


STRING = RosType(
    "std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
)  # fmt: skip
TRIGGER = RosType(
    "std_srvs/srv/Trigger", "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
)  # fmt: skip


def data_key(domain: int, name: str, kind: RosType, written_hash: str) -> str:
    """Return the key of a topic's samples or of a service's requests; the hash ``*`` matches every distribution."""
    return f"{domain}/{name.strip('/')}/{kind.dds}/{written_hash}"


def hash_of(key: str) -> str:
    """Return the hash in a key."""
    return key.rsplit("/", 1)[-1]


def qos_text(reliable: bool, depth: int) -> str:
    """Return the QoS as tokens write it: volatile, keep last. A field with its default value is empty."""
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
        """Return the token that announces the node."""
        return self._token(self.nid, "NN")

    def entity_token(self, entity: int, kind: Kind, topic: str, of: RosType, written_hash: str, qos: str) -> str:
        """Return the token that announces one of its publishers, subscriptions or services."""
        return f"{self._token(entity, kind)}/{_mangle(topic)}/{of.dds}/{written_hash}/{qos}"

    def _token(self, entity: int, kind: Kind) -> str:
        place = f"{_mangle(self.enclave or '/')}/{_mangle(self.namespace or '/')}/{self.name}"
        return f"@ros2_lv/{self.domain}/{self.zid}/{self.nid}/{entity}/{kind}/{place}"


def _mangle(name: str) -> str:
    return name.replace("/", "%")


@dataclass(frozen=True)
class Attachment:
    """The data beside each sample, request and reply. A reply repeats the sequence and the gid of its request."""

    sequence: int
    stamp_ns: int
    gid: bytes

    def encode(self) -> bytes:
        """Return the 33 bytes."""
        return _ATTACHMENT.pack(self.sequence, self.stamp_ns, GID_BYTES, self.gid)

    @classmethod
    def decode(cls, data: bytes) -> Attachment:
        """Return the attachment that :meth:`encode` wrote. Raise :class:`MalformedMessage` for other bytes."""
        if len(data) != _ATTACHMENT.size:
            raise MalformedMessage(
                f"attachment: {len(data)} bytes: rmw_zenoh sends {_ATTACHMENT.size} with each sample"
            )
        sequence, stamp_ns, length, gid = _ATTACHMENT.unpack(data)
        if length != GID_BYTES:
            raise MalformedMessage(f"attachment: gid of {shorten(length)} bytes: it has {GID_BYTES}")
        return cls(sequence, stamp_ns, gid)

    def name(self) -> str:
        """Return an id of the request, so that a request that arrives twice gets the same decision."""
        return f"ros-{blake2b(self.encode(), digest_size=12).hexdigest()}"


def gid_of(token: str) -> bytes:
    """Return the gid of an entity: 16 bytes of its token's hash. ``rmw_zenoh`` uses another hash function."""
    return blake2b(token.encode(), digest_size=GID_BYTES).digest()
