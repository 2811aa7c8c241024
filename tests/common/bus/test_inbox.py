"""Inbox: the newest message of each key or all in order; bounded; invalid messages are dropped."""

import logging
import threading
from collections.abc import Callable
from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus import inbox as inbox_module
from zenocap.common.bus.inbox import Inbox, outgoing
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.codec import encode
from zenocap.common.topics import HEALTH, REQUEST, SIGHTING, UNIVERSAL_BAP, Topic, topic_at

LOGGER = logging.getLogger("test.inbox")


@pytest.fixture
def inbox(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Inbox:
    """An inbox; parameters are other limits by name."""
    for name, limit in getattr(request, "param", {}).items():
        monkeypatch.setattr(inbox_module, name, limit)
    return Inbox(LOGGER)


def limited(**limits: int) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("inbox", [limits], ids=[" ".join(limits)], indirect=True)


def sighting(viewer: str, frame: int) -> m.Sighting:
    return built(m.Sighting, frame=frame, captured_ns=frame, viewer=viewer)


def bap(frame: int) -> m.UniversalBap:
    return built(m.UniversalBap, frame=frame, captured_ns=frame)


def put_sighting(inbox: Inbox, viewer: str, frame: int, *, every: bool = False) -> None:
    inbox.put(SIGHTING.at("r", viewer=viewer), SIGHTING, encode(sighting(viewer, frame)), frame, every=every)


def put_bap(inbox: Inbox, frame: int) -> None:
    inbox.put(UNIVERSAL_BAP.at("r"), UNIVERSAL_BAP, encode(bap(frame)), frame, every=False)


def drain(inbox: Inbox) -> list[tuple[str, int]]:
    """Topic or viewer, and frame, of all queued messages."""
    found = []
    while not inbox.empty:
        if (one := inbox.take(0.0)) is not None:  # None, too, after INVALID_S of invalid ones
            found.append((getattr(one.message, "viewer", one.topic.name), one.message.frame))
    return found


def test_a_latest_topic_delivers_only_the_newest_message_of_each_key_and_all_with_every(inbox: Inbox) -> None:
    for frame in range(3):
        put_sighting(inbox, "1", frame)
        put_sighting(inbox, "2", 10 + frame)
    assert drain(inbox) == [("1", 2), ("2", 12)]
    assert inbox.counters.dropped == {"superseded": 4}
    for frame in range(4):
        put_sighting(inbox, "1", frame, every=True)
    assert drain(inbox) == [("1", frame) for frame in range(4)]


def test_a_busy_key_does_not_starve_another(inbox: Inbox) -> None:
    put_sighting(inbox, "1", 0)
    put_sighting(inbox, "2", 0)
    order = []
    for frame in range(1, 5):
        order.append(inbox.take(0.0).message.viewer)
        put_sighting(inbox, "1", frame)
        put_sighting(inbox, "2", frame)
    assert order == ["1", "2", "1", "2"]


@given(st.lists(st.sampled_from(["1", "2", "bap"]), max_size=40))
def test_messages_are_delivered_in_order_and_every_loss_is_counted(puts: list[str]) -> None:
    inbox = Inbox(LOGGER)
    for frame, name in enumerate(puts):
        if name == "bap":
            put_bap(inbox, frame)
        else:
            put_sighting(inbox, name, frame)
    delivered = drain(inbox)
    baps = [frame for frame, name in enumerate(puts) if name == "bap"]
    assert [frame for name, frame in delivered if name == "universal_bap"] == baps
    assert len(delivered) + inbox.counters.dropped.get("superseded", 0) == len(puts)
    assert inbox.counters.received == len(delivered)


@limited(MAX_QUEUED=3)
def test_a_full_queue_drops_and_counts_its_oldest_messages(inbox: Inbox) -> None:
    put_sighting(inbox, "1", 0)
    for frame in range(5):
        put_bap(inbox, frame)
    assert drain(inbox) == [("1", 0), *(("universal_bap", frame) for frame in (2, 3, 4))]
    assert inbox.counters.dropped == {"queue_full": 2}


@limited(MAX_QUEUED_BYTES=2 * len(encode(bap(1))))
def test_a_queue_is_limited_in_bytes(inbox: Inbox) -> None:
    for frame in range(1, 6):
        put_bap(inbox, frame)
    assert drain(inbox) == [("universal_bap", 4), ("universal_bap", 5)]


@limited(MAX_QUEUED_BYTES=2 * len(encode(sighting("1", 1))))
def test_the_newest_messages_of_a_topic_are_limited_in_bytes(inbox: Inbox) -> None:
    """256 names of a silhouette of 4 MB took a gigabyte."""
    for frame, viewer in enumerate("1231", start=1):
        put_sighting(inbox, viewer, frame)
    inbox.put(SIGHTING.at("r", viewer="1"), SIGHTING, bytes(inbox_module.MAX_QUEUED_BYTES), 5, every=False)
    assert inbox.counters.dropped == {"queue_full": 2, "superseded": 1}
    assert drain(inbox) == [("1", 4), ("2", 2)]
    put_sighting(inbox, "3", 5)
    assert drain(inbox) == [("3", 5)]


@given(st.lists(st.tuples(st.sampled_from(["1", "2", *"abcdefgh"]), st.integers(1, 300)), max_size=40), st.booleans())
def test_messages_of_the_rig_are_delivered_whatever_others_send(puts: list[tuple[str, int]], every: bool) -> None:
    """Invented names had filled the queue, and then it refused newer messages of the rig's own."""
    own = [(viewer, frame) for frame, (viewer, _) in enumerate(puts) if viewer in "12"]
    appear = list(dict.fromkeys(viewer for viewer, _ in puts))
    with pytest.MonkeyPatch.context() as limits:
        limits.setattr(inbox_module, "MAX_QUEUED", 3)
        limits.setattr(inbox_module, "MAX_QUEUED_BYTES", 4 * len(encode(sighting("1", 99))))
        limits.setattr(inbox_module, "MAX_KEYS", 3)
        limits.setattr(inbox_module, "MAX_EVENTS", 3)
        inbox = Inbox(LOGGER, "r", [("viewer", "1"), ("viewer", "2")])
        for viewer in appear:
            inbox.put_event(Alive("viewer", viewer, True, 1))
        for frame, (viewer, size) in enumerate(puts):
            if viewer in "12":
                put_sighting(inbox, viewer, frame, every=every)
            else:
                inbox.put(SIGHTING.at("r", viewer=viewer), SIGHTING, bytes(size), frame, every=every)
        alive = [inbox.take(0.0).id for _ in appear[:3]]
        assert [one for one in alive if one in "12"] == [one for one in appear if one in "12"]
        found = drain(inbox)
        assert found == own[-3:] if every else dict(found) == dict(own)
    counters = inbox.counters
    assert counters.rejected.get("invalid", 0) <= 3
    assert len(puts + appear) == len(alive) + counters.received + sum((counters.rejected | counters.dropped).values())


@limited(MAX_QUEUED=3)
@pytest.mark.usefixtures("inbox")
def test_requests_of_others_displace_no_message_of_the_rig() -> None:
    inbox = Inbox(LOGGER, "r")
    put_bap(inbox, 1)
    for _ in range(9):
        inbox.put(REQUEST.at("r"), REQUEST, b"", 0, every=True)
    assert drain(inbox) == [("universal_bap", 1)]


@limited(MAX_QUEUED=3, MAX_KEYS=2)
def test_an_unread_queue_is_bounded(inbox: Inbox) -> None:
    for frame in range(100):
        put_bap(inbox, frame)
        put_sighting(inbox, f"viewer{frame}", frame)
    assert len(inbox._order) <= 2 * (3 + 2) + 1
    assert inbox.counters.dropped == {"queue_full": 97, "too_many_keys": 98}
    assert len(drain(inbox)) == 5


def test_invented_names_of_one_topic_displace_no_other_topic(inbox: Inbox, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox_module, "INVALID_S", 60.0)  # a busy machine reads the names for longer
    health, looked_up = built(m.Health, service="s", id="i"), topic_at.cache_info().misses
    for number in range(2000):
        inbox.put(HEALTH.at("r", service="s", id=str(number)), HEALTH, encode(health), 0, every=False)
    assert topic_at.cache_info().misses == looked_up
    put_sighting(inbox, "1", 7)
    assert drain(inbox) == [("1", 7)]  # the names of the others disagree with their keys
    assert inbox.counters.dropped == {"too_many_keys": 2000 - inbox_module.MAX_KEYS}
    put_sighting(inbox, "2", 8)
    assert drain(inbox) == [("2", 8)]


@pytest.mark.parametrize(
    ("topic", "key", "message", "text"),
    [
        (SIGHTING, "zenocap/r/viewer/2/sighting", sighting("1", 0), "viewer = '1', but '2' in its key"),
        (HEALTH, "zenocap/r/viewer/1/health", built(m.Health, service="tracker"),
         "service = 'tracker', but 'viewer' in its key"),
    ],
)  # fmt: skip
def test_a_message_that_disagrees_with_its_key_is_rejected(
    inbox: Inbox, topic: Topic, key: str, message: m.Message, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    inbox.put(key, topic, encode(message), 0, every=False)
    assert drain(inbox) == []
    assert inbox.counters.rejected == {"names": 1}
    assert text in caplog.text


def test_bad_bytes_are_counted_logged_once_and_dropped(inbox: Inbox, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(5):
        inbox.put(SIGHTING.at("r", viewer="1"), SIGHTING, b"\x91" * 50, 0, every=True)
    put_sighting(inbox, "1", 7, every=True)
    assert drain(inbox) == [("1", 7)]
    assert inbox.counters.rejected == {"invalid": 5}
    assert caplog.text.count("zenocap/r/viewer/1/sighting") == 1


def test_invalid_messages_without_end_keep_nobody(inbox: Inbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """It waited for a valid one as long as others came faster than they were decoded."""
    times = count(0.0, inbox_module.INVALID_S / 3)
    monkeypatch.setattr(inbox_module, "monotonic", lambda: next(times))
    for frame in range(20):
        inbox.put(SIGHTING.at("r", viewer=str(frame)), SIGHTING, b"x", frame, every=True)
    put_bap(inbox, 1)
    assert inbox.take(0.0) is None
    assert inbox.counters.queued > 10


def test_liveliness_changes_are_delivered_as_events(inbox: Inbox) -> None:
    event = Alive("viewer", "1", False, 3)
    inbox.put_event(event)
    assert inbox.take(0.0) == event


@pytest.mark.parametrize(("end", "received"), [(Inbox.wake, None), (lambda inbox: put_bap(inbox, 1), bap(1))])
def test_a_message_and_a_wake_end_a_blocking_take(inbox: Inbox, end: Callable[[Inbox], None], received: object) -> None:
    results: list[object] = []
    waiter = threading.Thread(target=lambda: results.append(inbox.take(30.0)))
    waiter.start()
    end(inbox)
    waiter.join(60.0)
    (found,) = results
    assert (found.message if isinstance(found, Envelope) else found) == received


def test_names_in_a_key_are_taken_from_the_message_and_others_are_not_sent() -> None:
    message = sighting("left", 1)
    assert outgoing("r", SIGHTING, message, {}) == ("zenocap/r/viewer/left/sighting", encode(message))
    with pytest.raises(ValueError, match="viewer = '1', but '2' in its key"):
        outgoing("r", SIGHTING, sighting("1", 1), {"viewer": "2"})
    with pytest.raises(ValueError, match="sighting carries Sighting, not UniversalBap"):
        outgoing("r", SIGHTING, bap(1), {})


def test_a_mark_is_called_when_all_messages_before_it_are_handled(inbox: Inbox) -> None:
    called: list[str] = []
    put_sighting(inbox, "1", 1)
    inbox.mark(lambda: called.append("first"))
    put_sighting(inbox, "1", 2)  # replaces the one before the mark
    put_sighting(inbox, "2", 1)
    inbox.mark(lambda: called.append("second"))
    assert not inbox.empty
    assert isinstance(inbox.take(0.0), Envelope)
    assert called == []  # taken, not yet handled
    assert isinstance(inbox.take(0.0), Envelope)
    assert called == ["first"]
    assert inbox.take(0.0) is None
    assert called == ["first", "second"]
    assert inbox.empty


def test_marks_are_called_when_the_inbox_is_released(inbox: Inbox) -> None:
    called: list[str] = []
    put_bap(inbox, 1)
    inbox.mark(lambda: called.append("mark"))
    inbox.release()
    assert called == ["mark"]
    assert drain(inbox) == [("universal_bap", 1)]
    assert called == ["mark"]


@limited(MAX_QUEUED=2, MAX_KEYS=2)
def test_marks_after_dropped_messages_are_still_called(inbox: Inbox) -> None:
    called: list[int] = []
    for frame in range(30):
        put_bap(inbox, frame)
        inbox.mark(lambda frame=frame: called.append(frame))
    assert [frame for _, frame in drain(inbox)] == [28, 29]
    assert called == list(range(30))


@limited(MAX_EVENTS=3)
def test_the_number_of_queued_marks_is_limited(inbox: Inbox) -> None:
    called: list[int] = []
    for number in range(10):
        inbox.mark(lambda number=number: called.append(number))
    assert inbox.take(0.0) is None
    assert called == [0, 1, 2]
    assert inbox.counters.dropped == {"queue_full": 7}
    inbox.mark(lambda: called.append(99))
    assert inbox.take(0.0) is None
    assert called[-1] == 99
