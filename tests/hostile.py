"""Bytes that mean harm, for every topic: what a broken, old or malicious program might send.  From a seed."""

import math
import random
import zlib
from collections.abc import Iterator
from functools import cache

import msgpack
import msgspec
from hypothesis import HealthCheck, Phase, given, seed, settings

from common import messages as m
from common.topics import TOPICS, Topic
from tests.message_strategies import messages_of

Plain = dict[str, object]
FAR_NS = 2**63 - 1
HUGE_BYTES = 7 << 20  # Zenoh itself stops at 8 MiB


@cache
def valid_messages(topic: Topic, count: int, number: int) -> tuple[m.Message, ...]:
    """Messages that are valid in form, whatever they say."""
    found: list[m.Message] = []

    @seed(number)
    @settings(max_examples=count, phases=(Phase.generate,), database=None, suppress_health_check=list(HealthCheck))
    @given(messages_of(topic.message))
    def collect(message: m.Message) -> None:
        found.append(message)

    collect()
    return tuple(found)


def plain(message: m.Message) -> Plain:
    found: Plain = msgspec.to_builtins(message, builtin_types=(bytes,))
    return found


def nested(depth: int) -> bytes:
    """A list in a list in a list ..."""
    return b"\x91" * depth + b"\xc0"


def no_message(rng: random.Random) -> Iterator[bytes]:
    """What is no message of any topic."""
    yield b""
    yield from (rng.randbytes(size) for size in (1, 7, 100, 5000))
    yield nested(100)
    yield nested(60_000)
    yield msgpack.packb({"type": "sighting"} | {f"key{n}": n for n in range(250)})
    yield b"\xdd\xff\xff\xff\xff"  # a list of 2^32 - 1
    yield b"\xdf\xff\xff\xff\xff\xa1a"  # a map of as many
    yield b"\xc6\xff\xff\xff\xff"  # bytes of as many
    yield b"\xdb\xff\xff\xff\xff"  # text of as many
    yield b"\x90" * 60_000
    yield msgpack.packb([[]] * 200)
    yield msgpack.packb(msgpack.ExtType(5, b"x" * 100))
    yield b"\x00" * HUGE_BYTES
    yield b"\xdc\xff\xff" + b"\x90" * 65535


def bent(message: m.Message, rng: random.Random) -> Iterator[bytes]:
    """A valid message, bent in one place each time."""
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
    """Silhouettes and previews that are valid in form and monstrous inside."""
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
    """Everything above for one topic; the same for the same number."""
    rng = random.Random(number)
    yield from no_message(rng)
    for message in valid_messages(topic, examples, number):
        yield from bent(message, rng)


def keys(topic: Topic, rig: str, ids: tuple[str, ...]) -> list[str]:
    """Keys of a topic for these viewers, or services."""
    return [topic.at(rig, viewer=id, service="viewer", id=id) for id in ids]


def strangers(rig: str, count: int) -> Iterator[tuple[Topic, str, str]]:
    """Topics and keys of services and viewers that the rig does not have, and their id."""
    for number in range(count):
        id = f"stranger{number}"
        for topic in TOPICS:
            if "{viewer}" in topic.key or "{id}" in topic.key:
                yield topic, topic.at(rig, viewer=id, service=f"service{number}", id=id), id


def _deep(depth: int) -> object:
    found: object = 0
    for _ in range(depth):
        found = [found]
    return found


def _large_jpeg_header() -> bytes:
    """Says that it is 65535 pixels square."""
    return bytes.fromhex("ffd8ffc0001108ffffffff03011100021101031101ffd9")
