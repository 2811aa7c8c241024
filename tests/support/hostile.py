"""Invalid and harmful payloads for every topic, deterministic by seed."""

import math
import random
import zlib
from collections.abc import Iterator
from functools import cache
from typing import TypeVar

import msgpack
import msgspec
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from tests.support.message_strategies import messages_of
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.topics import TOPICS, Topic

Plain = dict[str, object]
T = TypeVar("T")
FAR_NS = 2**63 - 1
HUGE_BYTES = 7 << 20  # Zenoh itself stops at 8 MiB


@cache
def valid_messages(topic: Topic, count: int, number: int) -> tuple[m.Message, ...]:
    """Messages of valid form with random content."""
    return drawn(messages_of(topic.message), count, number)


def drawn(strategy: SearchStrategy[T], count: int, number: int) -> tuple[T, ...]:
    """Values of a strategy.  number: seed."""
    found: list[T] = []

    @seed(number)
    @settings(max_examples=count, phases=(Phase.generate,), database=None, suppress_health_check=list(HealthCheck))
    @given(strategy)
    def collect(value: T) -> None:
        found.append(value)

    collect()
    return tuple(found)


def plain(message: m.Message) -> Plain:
    found: Plain = msgspec.to_builtins(message, builtin_types=(bytes,))
    return found


def nested(depth: int) -> bytes:
    """Deeply nested lists."""
    return b"\x91" * depth + b"\xc0"


def invalid_bytes(rng: random.Random) -> Iterator[bytes]:
    """Bytes that are no message of any topic."""
    yield b""
    yield from (rng.randbytes(size) for size in (1, 7, 100, 5000))
    yield nested(100)
    yield nested(60_000)
    yield msgpack.packb({"type": "sighting"} | {f"key{n}": n for n in range(250)})
    yield b"\xdd\xff\xff\xff\xff"  # a list of 2^32 - 1
    yield b"\xdf\xff\xff\xff\xff\xa1a"  # a map of 2^32 - 1
    yield b"\xc6\xff\xff\xff\xff"  # 2^32 - 1 bytes
    yield b"\xdb\xff\xff\xff\xff"  # a text of 2^32 - 1 bytes
    yield b"\x90" * 60_000
    yield msgpack.packb([[]] * 200)
    yield msgpack.packb(msgpack.ExtType(5, b"x" * 100))
    yield b"\x00" * HUGE_BYTES
    yield b"\xdc\xff\xff" + b"\x90" * 65535


def corrupted_copies(message: m.Message, rng: random.Random) -> Iterator[bytes]:
    """Copies of a valid message, each with one corrupted place."""
    good = plain(message)
    data = msgpack.packb(good)
    for _ in range(3):
        yield data[: rng.randrange(len(data))]
        place = rng.randrange(len(data))
        yield data[:place] + rng.randbytes(1) + data[place + 1 :]
    yield data + b"\xc0"
    yield msgpack.packb(good | {"version": 2})
    yield msgpack.packb(good | {"unknown": 1})
    yield msgpack.packb(good | {"type": "health" if good["type"] != "health" else "sighting"})
    for field in good:
        for value in (None, "x" * 5000, -1, 2**64 - 1, math.nan, math.inf, [1] * 200, {"a": 1}, b"\xff" * 100):
            yield msgpack.packb(good | {field: value})
        yield msgpack.packb({key: value for key, value in good.items() if key != field})
        yield msgpack.packb(good | {field: _deep(200)})


def bombs(rng: random.Random) -> Iterator[m.Message]:
    """Silhouettes and previews of valid form whose content is invalid or decompresses to huge images."""
    bomb = b"\x01" + zlib.compress(bytes(64 << 20), 9)
    for size, region in (
        ((16384, 16384), (0, 0, 16384, 16384)), ((160, 120), (0, 0, 160, 120)), ((160, 120), (100, 100, 2**40, 2**40)),
        ((1, 1), (0, 0, 0, 0)), ((16384, 16384), (2**53, 2**53, 1, 1)),
    ):  # fmt: skip
        for data in (bomb, b"", b"\x01", b"\x01" + rng.randbytes(100), rng.randbytes(1000)):
            yield m.Silhouette(frame=0, captured_ns=FAR_NS, viewer="1", size=size, region=region, data=data)
    yield m.Preview(frame=0, captured_ns=0, viewer="1", jpeg=rng.randbytes(1 << 20))
    yield m.Preview(frame=0, captured_ns=0, viewer="1", jpeg=_large_jpeg_header())


def payloads(topic: Topic, number: int, examples: int = 6) -> Iterator[bytes]:
    """All of the above for one topic; deterministic by number."""
    rng = random.Random(number)
    yield from invalid_bytes(rng)
    for message in valid_messages(topic, examples, number):
        yield from corrupted_copies(message, rng)


def keys(topic: Topic, rig: str, ids: tuple[str, ...]) -> list[str]:
    """Keys of a topic for these viewers, or services."""
    return [topic.at(rig, viewer=id, service="viewer", id=id) for id in ids]


def sent_by(topic: Topic, message: m.Message, rig: str, id: str, service: str = "viewer") -> tuple[str, bytes]:
    """Key and data of a message as if a service, or the viewer of that id, had sent it."""
    names = {"viewer": id, "service": service, "id": id}
    own = {name: value for name, value in names.items() if hasattr(message, name)}
    return topic.at(rig, **names), codec.encode(msgspec.structs.replace(message, **own))


def unknown_sources(rig: str, count: int) -> Iterator[tuple[Topic, str, str]]:
    """Topics, keys and ids of services and viewers that the rig does not have."""
    for number in range(count):
        id = f"unknown{number}"
        for topic in TOPICS:
            if "{viewer}" in topic.key or "{id}" in topic.key:
                yield topic, topic.at(rig, viewer=id, service=f"service{number}", id=id), id


def _deep(depth: int) -> object:
    found: object = 0
    for _ in range(depth):
        found = [found]
    return found


def _large_jpeg_header() -> bytes:
    """JPEG header that declares 65535 x 65535 pixels."""
    return bytes.fromhex("ffd8ffc0001108ffffffff03011100021101031101ffd9")
