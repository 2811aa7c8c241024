"""Between a transport's threads, which only queue bytes, and the one that receives: bounded, decoded, counted."""

import logging
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Condition
from time import monotonic

from common import codec
from common.bus.protocol import Alive, Counters, Envelope, Received, RoundTrip
from common.messages import Message
from common.runtime.logs import OncePerSource
from common.topics import Queueing, Topic

MAX_QUEUED = 8192  # messages of ALL topics
MAX_QUEUED_BYTES = 64 << 20
MAX_KEYS = 1024  # keys of LATEST and KEPT topics waiting at once
MAX_EVENTS = 1024  # alive changes and round trips; marks


@dataclass(slots=True)
class _Parcel:
    """A message in the queue; data is None once it was dropped or taken."""

    key: str
    topic: Topic
    data: bytes | None
    received_ns: int


@dataclass(frozen=True, slots=True)
class _Mark:
    """A place in the queue.  passed: called by the receiving thread once everything before it is handled."""

    passed: Callable[[], None]


class Inbox:
    """A thread-safe queue.  LATEST and KEPT topics keep their place in it, with the newest bytes of each key."""

    def __init__(self, logger: logging.Logger) -> None:
        self._ready = Condition()
        self._order: deque[_Parcel | _Mark] = deque()
        self._latest: dict[str, _Parcel] = {}
        self._fifo: deque[_Parcel] = deque()
        self._fifo_bytes = 0
        self._events: deque[Alive | RoundTrip] = deque()
        self._marks = 0
        self._woken = False
        self._received = 0
        self._rejected: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()
        self._once = OncePerSource(logger)

    @property
    def counters(self) -> Counters:
        with self._ready:
            return Counters(self._received, dict(self._rejected), dict(self._dropped))

    def put(self, key: str, topic: Topic, data: bytes, received_ns: int, *, every: bool) -> None:
        """Queue the bytes of one message; drops the oldest of the queue when it is full."""
        parcel = _Parcel(key, topic, data, received_ns)
        with self._ready:
            if every or topic.queueing is Queueing.ALL:
                self._put_last(parcel, data)
            else:
                self._put_latest(parcel)
            self._ready.notify()

    def put_event(self, event: Alive | RoundTrip) -> None:
        with self._ready:
            if len(self._events) >= MAX_EVENTS:
                self._events.popleft()
                self._dropped["queue_full"] += 1
            self._events.append(event)
            self._ready.notify()

    def mark(self, passed: Callable[[], None]) -> None:
        """Call `passed` in the receiving thread, when that asks for more after everything queued so far."""
        with self._ready:
            if self._marks >= MAX_EVENTS:
                self._dropped["queue_full"] += 1
                return
            self._marks += 1
            self._order.append(_Mark(passed))
            self._ready.notify()

    def release(self) -> None:
        """Call what waits for its mark now: nobody will receive any more."""
        with self._ready:
            self._marks = 0
            marks = [waiting for waiting in self._order if isinstance(waiting, _Mark)]
            self._order = deque(waiting for waiting in self._order if isinstance(waiting, _Parcel))
        for mark in marks:
            mark.passed()

    @property
    def empty(self) -> bool:
        with self._ready:
            return not (self._events or any(isinstance(w, _Mark) or w.data is not None for w in self._order))

    def reject(self, key: str, reason: str, text: str) -> None:
        """Count what cannot be used; log it once per key."""
        with self._ready:
            self._rejected[reason] += 1
        self._once.warn(key, reason, text)

    def wake(self) -> None:
        with self._ready:
            self._woken = True
            self._ready.notify()

    def take(self, timeout_s: float) -> Received | None:
        """The next valid event; None after `timeout_s` or when woken."""
        end_s = monotonic() + timeout_s
        while True:
            with self._ready:
                while not (self._events or self._order or self._woken):
                    left_s = end_s - monotonic()
                    if left_s <= 0:
                        return None
                    self._ready.wait(left_s)
                if self._events:
                    return self._events.popleft()
                waiting = self._pop()
                if waiting is None:
                    woken, self._woken = self._woken, False
                    if woken:
                        return None
                    continue
            match waiting:
                case _Mark(passed=passed):
                    passed()
                case parcel, data:
                    envelope = self._open(parcel, data)
                    if envelope is not None:
                        return envelope

    def _put_latest(self, parcel: _Parcel) -> None:
        waiting = self._latest.get(parcel.key)
        if waiting is not None:
            waiting.data, waiting.received_ns = parcel.data, parcel.received_ns
            self._dropped["superseded"] += 1
        elif len(self._latest) >= MAX_KEYS:
            self._dropped["too_many_keys"] += 1
        else:
            self._latest[parcel.key] = parcel
            self._order.append(parcel)

    def _put_last(self, parcel: _Parcel, data: bytes) -> None:
        self._order.append(parcel)
        self._fifo.append(parcel)
        self._fifo_bytes += len(data)
        while len(self._fifo) > MAX_QUEUED or self._fifo_bytes > MAX_QUEUED_BYTES:
            oldest = self._fifo.popleft()
            self._fifo_bytes -= len(oldest.data or b"")
            oldest.data = None
            self._dropped["queue_full"] += 1
        if len(self._order) > 2 * (MAX_QUEUED + MAX_KEYS):  # mostly dropped ones, when nobody receives
            self._order = deque(w for w in self._order if isinstance(w, _Mark) or w.data is not None)

    def _pop(self) -> tuple[_Parcel, bytes] | _Mark | None:
        while self._order:
            parcel = self._order.popleft()
            if isinstance(parcel, _Mark):
                self._marks -= 1
                return parcel
            data, parcel.data = parcel.data, None
            if data is None:
                continue
            if self._latest.get(parcel.key) is parcel:
                del self._latest[parcel.key]
            else:
                self._fifo.popleft()
                self._fifo_bytes -= len(data)
            return parcel, data
        return None

    def _open(self, parcel: _Parcel, data: bytes) -> Envelope | None:
        try:
            message = codec.decode(data, parcel.topic.message)
        except codec.BadMessage as error:
            self.reject(parcel.key, "invalid", str(error))
            return None
        disagreement = disagreeing_name(parcel.topic, parcel.key, message)
        if disagreement:
            self.reject(parcel.key, "names", disagreement)
            return None
        self._received += 1  # by the receiving thread alone
        return Envelope(parcel.key, parcel.topic, message, parcel.received_ns, data)


def disagreeing_name(topic: Topic, key: str, message: Message) -> str | None:
    """What is wrong when the message says another viewer, service or id than its key; None when they agree."""
    in_key = topic.names(key) or {}
    for field, value in topic.names_of(message).items():
        if in_key.get(field) != value:
            return f"{topic.name} says {field} {value!r}, its key says {in_key.get(field)!r}"
    return None


def outgoing(rig: str, topic: Topic, message: Message, names: dict[str, str]) -> tuple[str, bytes]:
    """Key and bytes of a message to be sent.  Raises BadMessage and ValueError as `Bus.publish` does."""
    if type(message) is not topic.message:
        raise ValueError(f"{topic.name} carries {topic.message.__name__}, not {type(message).__name__}")
    key = topic.at(rig, **(topic.names_of(message) | names))
    disagreement = disagreeing_name(topic, key, message)
    if disagreement:
        raise ValueError(disagreement)
    return key, codec.encode(message)


def check_key(rig: str, topic: Topic, key: str) -> None:
    """Raises ValueError when `key` is none of this topic and rig."""
    names = topic.names(key)
    if names is None or names["rig"] != rig:
        raise ValueError(f"{key}: no key of {topic.name} of rig {rig}, which are like {topic.on(rig)}")
