"""State recovery: last messages are kept, returned to a successor, and dropped after a time."""

import time
from collections.abc import Iterator
from contextlib import ExitStack

import msgspec
import pytest
import zenoh

from tests.common.bus.test_inbox import bap
from tests.support.networks import client, free_endpoint, wait_for
from tests.support.processes import PATIENCE_S
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.bus.zenoh_state_recovery import MAX_KEYS, RETENTION_S, RecoveryStore, agreed
from zenocap.common.codec import encode
from zenocap.common.runtime.clock import ManualClock, RealClock
from zenocap.common.topics import STATE_RECOVERY, TOPICS, UNIVERSAL_BAP, UNIVERSAL_BDP, Topic

RIG = "recovery"
BODY = m.UniversalBdp(
    frame=1, captured_ns=5, body=m.Body(anatomy="ten-parts", sizes={"torso": (0.5, 0.2, 0.1)}, offsets={}), ratio=1.0
)


@pytest.fixture
def session() -> Iterator[zenoh.Session]:
    with open_session(ZenohOptions(listen=(free_endpoint(),), multicast_scouting=False)) as session:
        yield session


def test_recoverable_topics_have_one_key_each() -> None:
    assert {topic.name for topic in TOPICS if topic.recoverable} == {
        "universal_bdp", "universal_bap", "tracker_bdp", "tracker_pose", "frame_rate", "camera_delays",
    }  # fmt: skip
    assert all(topic.at(RIG) == topic.on(RIG) for topic in TOPICS if topic.recoverable)


def test_messages_are_kept_while_their_service_publishes_and_for_a_time_after(session: zenoh.Session) -> None:
    clock = ManualClock(100 * 10**9)
    store = RecoveryStore(session, RIG, lambda: clock.now_ns() / 1e9)
    body, pose = UNIVERSAL_BDP.at(RIG), UNIVERSAL_BAP.at(RIG)
    store.keep(body, UNIVERSAL_BDP, b"body")
    clock.advance(3600 * 10**9)
    assert store.last(body) is None
    store.keep(pose, UNIVERSAL_BAP, b"pose")
    assert store.last(body) == b"body"
    clock.advance(round(RETENTION_S * 10**9))
    assert (store.last(body), store.last(pose)) == (b"body", b"pose")
    clock.advance(10**9)
    assert (store.last(body), store.last(pose)) == (None, None)
    assert store.last(UNIVERSAL_BAP.at("another")) is None


def test_the_number_of_kept_keys_is_limited(session: zenoh.Session) -> None:
    store = RecoveryStore(session, "*")
    for number in range(2 * MAX_KEYS):
        store.keep(UNIVERSAL_BAP.at(f"rig{number}"), UNIVERSAL_BAP, b"pose")
    kept = [number for number in range(2 * MAX_KEYS) if store.last(UNIVERSAL_BAP.at(f"rig{number}"))]
    assert kept == list(range(MAX_KEYS))


NOW_NS = 10**15
OLD, MIDDLE, NEW = (encode(bap(frame)) for frame in (3, 6, 9))
FUTURE = encode(msgspec.structs.replace(bap(9), captured_ns=NOW_NS + 1))


@pytest.mark.parametrize(
    ("replies", "used"),
    [
        pytest.param([("a", b"\xff"), ("b", OLD), ("c", NEW), ("d", MIDDLE), ("e", b"")], NEW, id="newest of equal votes"),
        pytest.param([("a", b"\xff")], None, id="no valid one"),
        pytest.param([("a", OLD), ("b", OLD), *[("c", NEW)] * 5], OLD, id="most sessions, not most replies"),
        pytest.param([("a", OLD), ("b", OLD), ("c", NEW), ("d", NEW), ("e", NEW)], NEW, id="most sessions"),
        pytest.param([("a", OLD), ("b", FUTURE), ("c", FUTURE)], OLD, id="none captured in the future"),
        pytest.param([("b", FUTURE)], None, id="only one captured in the future"),
    ],
)
def test_the_valid_reply_of_most_sessions_is_used_of_several_the_newest(replies, used):
    assert agreed(replies, m.UniversalBap, NOW_NS) == used


def recovered(bus: ZenohBus, topic: Topic) -> Envelope:
    """The last message of a topic; asked for again when the replies are too late."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        bus.request_recovery(topic)
        event = bus.receive(2.0)
        if event is not None:
            assert isinstance(event, Envelope)
            return event
    raise AssertionError(f"no {topic.name} was recovered")


@pytest.mark.core
def test_a_false_body_of_one_session_does_not_outvote_the_subscribers() -> None:
    """An intruder on an open network replies several times, and with a later time than the true body."""
    endpoint, clock = free_endpoint(), RealClock()
    false = msgspec.structs.replace(BODY, frame=9, captured_ns=clock.now_ns(), ratio=0.5)
    with ExitStack() as stack:
        stack.enter_context(open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)))
        readers = [stack.enter_context(ZenohBus.open(client(endpoint), RIG, clock)) for _ in range(2)]
        intruder = stack.enter_context(open_session(client(endpoint)))
        for reader in readers:
            reader.subscribe(UNIVERSAL_BDP)
        with ZenohBus.open(client(endpoint), RIG, clock) as first:
            first.publish(UNIVERSAL_BDP, BODY)
            for reader in readers:
                wait_for(reader, lambda event: isinstance(event, Envelope) and event.message == BODY)
        asked: list[int] = []
        key = STATE_RECOVERY.format(rig=RIG, topic=UNIVERSAL_BDP.name)

        def reply(query: zenoh.Query) -> None:
            with query:
                asked.append(1)
                query.reply(key, encode(false))

        for expression in (key, STATE_RECOVERY.format(rig=RIG, topic="*")):
            intruder.declare_queryable(expression, reply)
        second = stack.enter_context(ZenohBus.open(client(endpoint), RIG, clock))
        while not asked:  # until its queryables have reached the router
            assert recovered(second, UNIVERSAL_BDP).message == BODY


@pytest.mark.core
def test_a_restarted_service_receives_its_last_messages_from_a_subscriber() -> None:
    endpoint = free_endpoint()
    clock = RealClock()
    with (
        open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)),
        ZenohBus.open(client(endpoint), RIG, clock) as reader,
    ):
        reader.subscribe(UNIVERSAL_BDP)
        reader.subscribe(UNIVERSAL_BAP)
        with ZenohBus.open(client(endpoint), RIG, clock) as first:
            first.request_recovery(UNIVERSAL_BAP)
            assert first.receive(0.3) is None, "no subscriber has stored a message yet"
            first.publish(UNIVERSAL_BDP, BODY)
            for frame in range(20):
                first.publish(UNIVERSAL_BAP, bap(frame))
            wait_for(reader, lambda event: isinstance(event, Envelope) and event.message == bap(19))
        with ZenohBus.open(client(endpoint), RIG, clock) as second:
            body = recovered(second, UNIVERSAL_BDP)
            assert (body.key, body.message) == (UNIVERSAL_BDP.at(RIG), BODY)
            assert recovered(second, UNIVERSAL_BAP).message == bap(19)
