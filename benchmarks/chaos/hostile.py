"""A program on the network of a rig that does not belong to it: floods of messages of one kind.

python -m benchmarks.chaos.hostile KIND RIG ENDPOINT SECONDS SEED

malformed     bytes that are no message, and valid ones with one wrong place, on every key of the rig
strangers     valid messages of viewers and services that the rig does not have
huge          messages of 7 MB, and silhouettes and previews that decompress to huge images
impostor      valid messages of random content on the keys of the rig's own services, without requests
skewed        the silhouettes of viewer 1 again, stamped up to 5 s earlier or later
false orders  requests of another rig, another version, an unknown kind, with unknown or missing fields
"""

import itertools
import random
import sys
import time
from collections.abc import Callable, Iterable, Iterator

import msgpack
import msgspec
import zenoh

from benchmarks.chaos.schedule import SKEWED_NS
from tests.support.hostile import (
    bombs,
    corrupted_copies,
    invalid_bytes,
    keys,
    plain,
    sent_by,
    unknown_sources,
    valid_messages,
)
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration
from zenocap.common.topics import REQUEST, SILHOUETTE, TOPICS, Topic, topic_of

PER_S = {"malformed": 1500, "strangers": 1500, "huge": 20, "impostor": 200, "skewed": 60, "false orders": 20}
SMALL_BYTES = 100_000
STRANGERS = 400
LARGEST_SKEW_NS = 5_000_000_000

Message = tuple[str, bytes]


def malformed(rig: str, rng: random.Random) -> Iterator[Message]:
    for topic in TOPICS:
        bad = [data for data in invalid_bytes(rng) if len(data) < SMALL_BYTES]
        for message in valid_messages(topic, 2, 1):
            bad += [data for data in corrupted_copies(message, rng) if not _is_valid(data, topic)]
        for data in bad:
            yield rng.choice(keys(topic, rig, ("1", "unknown"))), data


def _is_valid(data: bytes, topic: Topic) -> bool:
    """Whether bytes are a message of a topic, as a copy of a valid one may be in spite of a changed byte."""
    try:
        codec.decode(data, topic.message)
    except codec.BadMessage:
        return False
    return True


def strangers(rig: str, rng: random.Random) -> Iterator[Message]:
    for topic, key, id in unknown_sources(rig, STRANGERS):
        yield key, sent_by(topic, rng.choice(valid_messages(topic, 20, 1)), rig, id, key.split("/")[2])[1]


def huge(rig: str, rng: random.Random) -> Iterator[Message]:
    for topic in TOPICS:
        yield topic.at(rig, viewer="1", service="viewer", id="1"), bytes(7 << 20)
    for message in bombs(rng):
        yield topic_of(type(message)).at(rig, viewer="1"), codec.encode(message)


def impostor(rig: str, rng: random.Random) -> Iterator[Message]:
    found = []
    for topic in TOPICS:
        if topic is not REQUEST:
            found += [sent_by(topic, message, rig, "1") for message in valid_messages(topic, 60, rng.randrange(1000))]
    rng.shuffle(found)
    yield from found


def false_orders(rig: str, rng: random.Random) -> Iterator[Message]:
    whats = ("measure", "record", "stop_recording")
    good = plain(m.Request(frame=1, captured_ns=time.time_ns(), what="measure")) | {"what": rng.choice(whats)}
    key = REQUEST.at(rig)
    wrong = ({"version": 2}, {"what": "delete"}, {"unknown": 1}, {"frame": -1}, {"type": "health"}, {"what": ["record"]})
    for change in wrong:
        yield key, msgpack.packb(good | change)
    for field in good:
        yield key, msgpack.packb({name: value for name, value in good.items() if name != field and name != "version"})[:-1]
    yield key, msgpack.packb(good) + b"\xc0"
    for what in whats:
        yield REQUEST.at(f"{rig}x"), msgpack.packb(good | {"what": what})
        yield f"{key}/{what}", msgpack.packb(good | {"what": what})
        yield f"zenocap/{rig}/viewer/1/request", msgpack.packb(good | {"what": what})


MAKERS: dict[str, Callable[[str, random.Random], Iterable[Message]]] = {
    "malformed": malformed, "strangers": strangers, "huge": huge, "impostor": impostor, "false orders": false_orders,
}  # fmt: skip


def flood(session: zenoh.Session, messages: Iterable[Message], per_s: float, until_s: float) -> int:
    """Publish messages again and again at a rate; returns their number."""
    begin_s, sent = time.monotonic(), 0
    for key, data in itertools.cycle(messages):
        session.put(key, data, congestion_control=zenoh.CongestionControl.DROP)
        sent += 1
        time.sleep(max(0.0, begin_s + sent / per_s - time.monotonic()))
        if time.monotonic() >= until_s:
            break
    return sent


def skew(session: zenoh.Session, rig: str, rng: random.Random, until_s: float) -> int:
    """Publish every silhouette of viewer 1 again with another time; returns their number."""
    sent = 0

    def again(sample: zenoh.Sample) -> None:
        nonlocal sent
        message = codec.decode(sample.payload.to_bytes(), m.Silhouette)
        if isinstance(message, m.Silhouette) and message.captured_ns % 1_000_000 != SKEWED_NS:  # not its own copy
            shifted_ns = message.captured_ns + rng.randint(-LARGEST_SKEW_NS, LARGEST_SKEW_NS)
            copy = msgspec.structs.replace(message, captured_ns=shifted_ns // 1_000_000 * 1_000_000 + SKEWED_NS)
            waiting.append((str(sample.key_expr), codec.encode(copy)))

    waiting: list[Message] = []
    subscriber = session.declare_subscriber(SILHOUETTE.at(rig, viewer="1"), again)
    while time.monotonic() < until_s:
        while waiting:
            session.put(*waiting.pop())
            sent += 1
        time.sleep(0.01)
    subscriber.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
    return sent


def main(kind: str, rig: str, endpoint: str, seconds: str, seed: str) -> None:
    rng = random.Random(seed)
    messages = list(MAKERS[kind](rig, rng)) if kind in MAKERS else []
    with zenoh.open(configuration(ZenohOptions("client", (endpoint,), multicast_scouting=False))) as session:
        print("ready", flush=True)
        sys.stdin.readline()
        until_s = time.monotonic() + float(seconds)
        sent = skew(session, rig, rng, until_s) if kind == "skewed" else flood(session, messages, PER_S[kind], until_s)
        print(sent, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
