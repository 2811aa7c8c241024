"""Reader of Foxglove channels that uses only the descriptors in the file, as Lichtblick does."""

import json
from functools import lru_cache

import numpy as np
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import Message

from zenocap.common.arrays import Floats
from zenocap.common.bus.protocol import Envelope
from zenocap.common.codec import encode
from zenocap.common.formats.foxglove.channels import FoxgloveMessage
from zenocap.common.messages import Message as RigMessage
from zenocap.common.recording.writer import Channel
from zenocap.common.topics import topic_of


@lru_cache
def message_class(schema_name: str, schema: bytes) -> type[Message]:
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema_name))


def parsed(channel: Channel, data: bytes) -> Message:
    assert (channel.encoding, channel.schema_encoding) == ("protobuf", "protobuf")
    return message_class(channel.schema_name, channel.schema).FromString(data)


def by_topic(messages: list[FoxgloveMessage]) -> dict[str, Message | dict[str, object]]:
    """The last part of each topic to its message."""
    return {
        each.channel.topic.rpartition("/")[2]: json.loads(each.data)
        if each.channel.encoding == "json"
        else parsed(each.channel, each.data)
        for each in messages
    }


def in_envelope(message: RigMessage, rig: str = "studio", received_ns: int = 0) -> Envelope:
    topic = topic_of(type(message))
    return Envelope(topic.at(rig, **topic.names_of(message)), topic, message, received_ns, encode(message))


def xyz(vector: Message) -> Floats:
    return np.array([vector.x, vector.y, vector.z])


def turn(q: Message) -> Floats:
    """(3, 3) of a quaternion, straight from its definition v' = q v q*."""
    v = np.array([q.x, q.y, q.z])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    rotation: Floats = np.eye(3) + 2 * q.w * cross + 2 * cross @ cross
    return rotation
