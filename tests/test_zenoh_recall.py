"""What was said outlives who said it: remembered by readers, told to the next one, forgotten after a while."""

from collections.abc import Iterator

import pytest
import zenoh
from test_zenoh_bus import client, free_endpoint, wait_for

from common import messages as m
from common.bus.protocol import Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_recall import MAX_KEYS, REMEMBERED_S, Hearsay, newest
from common.bus.zenoh_session import ZenohOptions, open_session
from common.codec import encode
from common.runtime.clock import RealClock
from common.topics import TOPICS, UNIVERSAL_BAP, UNIVERSAL_BDP
from tests.test_inbox import bap

RIG = "recall"
BODY = m.UniversalBdp(
    frame=1, captured_ns=5, body=m.Body(anatomy="ten-parts", sizes={"torso": (0.5, 0.2, 0.1)}, offsets={}), ratio=1.0
)


class Seconds:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def session() -> Iterator[zenoh.Session]:
    with open_session(ZenohOptions(listen=(free_endpoint(),), multicast_scouting=False)) as session:
        yield session


def test_what_is_recalled_has_one_key_and_is_said_by_services_with_a_memory() -> None:
    assert {topic.name for topic in TOPICS if topic.recalled} == {
        "universal_bdp", "universal_bap", "tracker_bdp", "tracker_pose",
    }  # fmt: skip
    for topic in TOPICS:
        if topic.recalled:
            assert topic.at(RIG) == topic.on(RIG)


def test_a_body_is_remembered_as_long_as_its_service_speaks_and_a_minute_longer(session: zenoh.Session) -> None:
    now_s = Seconds()
    hearsay = Hearsay(session, RIG, now_s)
    body, pose = UNIVERSAL_BDP.at(RIG), UNIVERSAL_BAP.at(RIG)
    hearsay.keep(body, UNIVERSAL_BDP, b"body")
    now_s.now += 3600
    assert hearsay.last(body) is None
    hearsay.keep(pose, UNIVERSAL_BAP, b"pose")
    assert hearsay.last(body) == b"body"
    now_s.now += REMEMBERED_S
    assert (hearsay.last(body), hearsay.last(pose)) == (b"body", b"pose")
    now_s.now += 1
    assert (hearsay.last(body), hearsay.last(pose)) == (None, None)
    assert hearsay.last(UNIVERSAL_BAP.at("another")) is None


def test_memory_is_bounded(session: zenoh.Session) -> None:
    hearsay = Hearsay(session, "*")
    for number in range(2 * MAX_KEYS):
        hearsay.keep(UNIVERSAL_BAP.at(f"rig{number}"), UNIVERSAL_BAP, b"pose")
    kept = [number for number in range(2 * MAX_KEYS) if hearsay.last(UNIVERSAL_BAP.at(f"rig{number}"))]
    assert kept == list(range(MAX_KEYS))


def test_of_several_answers_the_newest_counts_and_a_bad_one_does_not() -> None:
    answers = [encode(bap(frame)) for frame in (3, 9, 6)]
    assert newest([b"\xff", *answers, b""], m.UniversalBap) == answers[1]
    assert newest([b"\xff"], m.UniversalBap) is None


@pytest.mark.system
def test_who_starts_anew_is_told_what_was_said_before_it_by_who_heard_it() -> None:
    endpoint = free_endpoint()
    clock = RealClock()
    with (
        open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)),
        ZenohBus.open(client(endpoint), RIG, clock) as reader,
    ):
        reader.subscribe(UNIVERSAL_BDP)
        reader.subscribe(UNIVERSAL_BAP)
        with ZenohBus.open(client(endpoint), RIG, clock) as first:
            first.recall(UNIVERSAL_BAP)
            assert first.receive(0.3) is None, "nobody has anything to tell yet"
            first.publish(UNIVERSAL_BDP, BODY)
            for frame in range(20):
                first.publish(UNIVERSAL_BAP, bap(frame))
            wait_for(reader, lambda event: isinstance(event, Envelope) and event.message == bap(19))
        with ZenohBus.open(client(endpoint), RIG, clock) as second:
            second.recall(UNIVERSAL_BDP)
            told = second.receive(5.0)
            assert isinstance(told, Envelope)
            assert (told.key, told.message) == (UNIVERSAL_BDP.at(RIG), BODY)
            second.recall(UNIVERSAL_BAP)
            told = second.receive(5.0)
            assert isinstance(told, Envelope)
            assert told.message == bap(19)
