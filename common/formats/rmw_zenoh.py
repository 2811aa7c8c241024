"""Wire form of rmw_zenoh_cpp (ROS 2 over Zenoh): keys, tokens, attachments, GIDs.

After `liveliness_utils`, `attachment_helpers`, `qos` and `rmw_publisher_data` of github.com/ros2/rmw_zenoh: all releases
for Humble, Kilted and Rolling, and Jazzy from 0.2.4 on (before, attachments were different).  Humble has no type hashes.
A message is put on `DOMAIN/TOPIC/TYPE/HASH`.  Tokens that announce a node (NN) and its publishers (MP), with
"%" for "/" in names:

    @ros2_lv/DOMAIN/SESSION/NODE_ID/NODE_ID/NN/ENCLAVE/NAMESPACE/NODE
    @ros2_lv/DOMAIN/SESSION/NODE_ID/ENTITY_ID/MP/ENCLAVE/NAMESPACE/NODE/TOPIC/TYPE/HASH/QOS
"""

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass

NODE_ID = 0  # of the only node of a session; its publishers are numbered from 1
NO_ENCLAVE = "%"  # the mangled "/"
NO_HASH = "TypeHashNotSupported"  # Humble's in place of every hash
DEFAULT_DEPTH = 42  # of rmw_zenoh; a default is left out of a token


@dataclass(frozen=True)
class RosType:
    """name: package/msg/Name.  hash: RIHS01 of its definition (REP-2011), equal on both sides of a topic."""

    name: str
    hash: str

    @property
    def dds_name(self) -> str:
        package, kind, name = self.name.split("/")
        return f"{package}::{kind}::dds_::{name}_"


# Of Jazzy and Kilted alike; a test computes the hashes from the definitions in rosbags.
TF_MESSAGE = RosType("tf2_msgs/msg/TFMessage", "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087")
MARKER_ARRAY = RosType(
    "visualization_msgs/msg/MarkerArray", "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"
)


@dataclass(frozen=True)
class RosTopic:
    """A topic of a publisher.  name: absolute, such as "/tf".  depth: of its history.

    Its quality of service is otherwise rmw_zenoh's default: reliable, volatile, keep last.
    """

    name: str
    kind: RosType
    depth: int

    @property
    def qos(self) -> str:
        """Quality of service as in a token: other nodes leave defaults out when they compute a publisher's GID."""
        return f"::,{'' if self.depth == DEFAULT_DEPTH else self.depth}:,:,:,,"

    def key(self, domain: int) -> str:
        """Key of its messages."""
        return f"{domain}/{self.name.strip('/')}/{self.kind.dds_name}/{self.kind.hash}"


@dataclass(frozen=True)
class RosNode:
    """A node.  domain: ROS_DOMAIN_ID.  namespace: absolute, "/" for none.  session: hexadecimal id of its Zenoh session."""

    domain: int
    namespace: str
    name: str
    session: str

    def token(self) -> str:
        return f"{self._head(NODE_ID, 'NN')}"

    def publisher_token(self, id: int, topic: RosTopic) -> str:
        """id: number of the publisher in its session, from 1."""
        return f"{self._head(id, 'MP')}/{_mangled(topic.name)}/{topic.kind.dds_name}/{topic.kind.hash}/{topic.qos}"

    def _head(self, id: int, entity: str) -> str:
        owner = f"{NO_ENCLAVE}/{_mangled(self.namespace)}/{self.name}"
        return f"@ros2_lv/{self.domain}/{self.session}/{NODE_ID}/{id}/{entity}/{owner}"


def ros_name(name: str) -> str:
    """A name that ROS allows: letters, digits and single "_" only, with a letter at its beginning."""
    allowed = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return allowed if allowed[:1].isalpha() else f"rig_{allowed}".rstrip("_")


def gid_of(token: str, xxh3_128_digest: Callable[[bytes], bytes]) -> bytes:
    """Global id (16 bytes) of a publisher: XXH3-128 of its token, low half first, both little-endian.

    xxh3_128_digest: the canonical digest, which is big-endian, high half first: that of the package xxhash.
    """
    return xxh3_128_digest(token.encode())[::-1]


def attachment(sequence_number: int, sent_ns: int, gid: bytes) -> bytes:
    """Attachment of a message, in the serialization of zenoh-ext: two int64, then the array with its length.

    sequence_number: from 1.  sent_ns: nanoseconds since the Unix epoch.
    """
    return struct.pack("<qqB", sequence_number, sent_ns, len(gid)) + gid


def _mangled(name: str) -> str:
    return name.replace("/", "%")
