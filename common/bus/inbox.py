"""Bounded queue between a transport's threads (bytes) and the receiving thread (decoding)."""

import logging
from collections import Counter, deque
from collections.abc import Callable, Collection
from dataclasses import dataclass
from threading import Condition
from time import monotonic

from zenocap.common import codec
from zenocap.common.bus.protocol import Alive, Counters, Envelope, Received, RoundTrip
from zenocap.common.messages import Message
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.topics import REQUEST, Queueing, Topic, is_of

MAX_QUEUED = 8192  # queued messages of ALL topics, of own keys and of foreign ones
MAX_QUEUED_BYTES = 64 << 20  # of both of these, and of foreign keys of each LATEST or LATCHED topic; chosen by hand
MAX_KEYS = 256  # foreign keys of each LATEST or LATCHED topic in the queue, so that invented names displace no other topic
INVALID_S = 0.1  # longest delay of `take` by a flood of invalid messages, beyond its own limit; chosen by hand
MAX_EVENTS = 1024  # queued alive changes and round trips; queued marks


@dataclass(slots=True)
class _QueuedMessage:
    """A message in the queue; data is None after it was dropped or taken.  foreign: any program may send it."""

    key: str
    topic: Topic
    data: bytes | None
    received_ns: int
    foreign: bool


@dataclass(frozen=True, slots=True)
class _Mark:
    """A position in the queue.  passed: called by the receiving thread after everything before it is handled."""

    passed: Callable[[], None]


class Inbox:
    """Thread-safe queue.  A message of a LATEST or LATCHED topic replaces the queued one of its key, at its position.

    rig, own: its services: foreign keys, however many others invent, displace none of their messages and events.
    """

    def __init__(self, logger: logging.Logger, rig: str = "", own: Collection[tuple[str, str]] = ()) -> None:
        self._rig, self._own = rig, frozenset(own)
        self._ready = Condition()
        self._order: deque[_QueuedMessage | _Mark] = deque()
        self._latest: dict[str, _QueuedMessage] = {}
        self._keys, self._bytes = Counter[str](), Counter[str]()  # by topic, of foreign keys in _latest
        self._fifos: dict[bool, deque[_QueuedMessage]] = {False: deque(), True: deque()}  # by whether they are foreign
        self._fifo_bytes = Counter[bool]()
        self._events: deque[Alive | RoundTrip] = deque()
        self._marks = 0
        self._woken = False
        self._received = 0
        self._rejected: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()
        self._log_once = OncePerSource(logger)

    @property
    def counters(self) -> Counters:
        with self._ready:
            return Counters(self._received, dict(self._rejected), dict(self._dropped), len(self._events) + self._queued)

    @property
    def _queued(self) -> int:
        return len(self._latest) + sum(map(len, self._fifos.values()))

    def is_own(self, topic: Topic, key: str) -> bool:
        """Whether a key is of the rig's own services."""
        return is_of(self._own, self._rig, topic.names(key))

    def put(self, key: str, topic: Topic, data: bytes, received_ns: int, *, every: bool) -> None:
        """Queue the bytes of one message; drops the oldest of the queue when it is full."""
        queued = _QueuedMessage(key, topic, data, received_ns, topic is REQUEST or not self.is_own(topic, key))
        with self._ready:
            if every or topic.queueing is Queueing.ALL:
                self._put_last(queued, data)
            else:
                self._put_latest(queued, data)
            self._ready.notify()

    def put_event(self, event: Alive | RoundTrip) -> None:
        with self._ready:
            if len(self._events) >= MAX_EVENTS:
                self._events.remove(next(filter(self._is_foreign, self._events), self._events[0]))
                self._dropped["queue_full"] += 1
            self._events.append(event)
            self._ready.notify()

    def mark(self, passed: Callable[[], None]) -> None:
        """Call `passed` in the receiving thread when everything queued so far is handled, at its next call of `take`."""
        with self._ready:
            if self._marks >= MAX_EVENTS:
                self._dropped["queue_full"] += 1
                return
            self._marks += 1
            self._order.append(_Mark(passed))
            self._ready.notify()

    def release(self) -> None:
        """Call the waiting marks now, because nothing more is received."""
        with self._ready:
            self._marks = 0
            marks = [waiting for waiting in self._order if isinstance(waiting, _Mark)]
            self._order = deque(waiting for waiting in self._order if isinstance(waiting, _QueuedMessage))
        for mark in marks:
            mark.passed()

    @property
    def empty(self) -> bool:
        with self._ready:
            return not (self._events or any(isinstance(w, _Mark) or w.data is not None for w in self._order))

    def reject(self, key: str, reason: str, text: str) -> None:
        """Count an unusable message; log it once per key."""
        with self._ready:
            self._rejected[reason] += 1
        self._log_once.warn(key, reason, text)

    def wake(self) -> None:
        with self._ready:
            self._woken = True
            self._ready.notify()

    def take(self, timeout_s: float) -> Received | None:
        """The next valid event; None after `timeout_s`, INVALID_S later in a flood of invalid ones, or when woken."""
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
                case queued, data:
                    envelope = self._open(queued, data)
                    if envelope is not None:
                        return envelope
                    if monotonic() > end_s + INVALID_S:
                        return None

    def _is_foreign(self, event: Alive | RoundTrip) -> bool:
        return isinstance(event, Alive) and (event.service, event.id) not in self._own

    def _put_latest(self, queued: _QueuedMessage, data: bytes) -> None:
        topic, waiting = queued.topic.name, self._latest.get(queued.key)
        size = self._bytes[topic] + len(data) - (0 if waiting is None else len(waiting.data or b""))
        if queued.foreign:
            if waiting is None and self._keys[topic] >= MAX_KEYS:
                self._dropped["too_many_keys"] += 1
                return
            if size > MAX_QUEUED_BYTES:
                self._dropped["queue_full"] += 1
                return
            self._bytes[topic] = size
            self._keys[topic] += waiting is None
        if waiting is not None:
            waiting.data, waiting.received_ns = data, queued.received_ns
            self._dropped["superseded"] += 1
        else:
            self._latest[queued.key] = queued
            self._order.append(queued)

    def _put_last(self, queued: _QueuedMessage, data: bytes) -> None:
        fifo = self._fifos[queued.foreign]
        self._order.append(queued)
        fifo.append(queued)
        self._fifo_bytes[queued.foreign] += len(data)
        while len(fifo) > MAX_QUEUED or self._fifo_bytes[queued.foreign] > MAX_QUEUED_BYTES:
            oldest = fifo.popleft()
            self._fifo_bytes[queued.foreign] -= len(oldest.data or b"")
            oldest.data = None
            self._dropped["queue_full"] += 1
        if len(self._order) > 2 * (self._queued + self._marks):  # mostly dropped ones, when no thread receives
            self._order = deque(w for w in self._order if isinstance(w, _Mark) or w.data is not None)

    def _pop(self) -> tuple[_QueuedMessage, bytes] | _Mark | None:
        while self._order:
            queued = self._order.popleft()
            if isinstance(queued, _Mark):
                self._marks -= 1
                return queued
            data, queued.data = queued.data, None
            if data is None:
                continue
            if self._latest.get(queued.key) is queued:
                del self._latest[queued.key]
                if queued.foreign:
                    self._keys[queued.topic.name] -= 1
                    self._bytes[queued.topic.name] -= len(data)
            else:
                self._fifos[queued.foreign].popleft()
                self._fifo_bytes[queued.foreign] -= len(data)
            return queued, data
        return None

    def _open(self, queued: _QueuedMessage, data: bytes) -> Envelope | None:
        try:
            message = codec.decode(data, queued.topic.message)
        except codec.BadMessage as error:
            self.reject(queued.key, "version" if isinstance(error, codec.OtherVersion) else "invalid", str(error))
            return None
        disagreement = disagreeing_name(queued.topic, queued.key, message)
        if disagreement:
            self.reject(queued.key, "names", disagreement)
            return None
        self._received += 1  # written by the receiving thread only
        return Envelope(queued.key, queued.topic, message, queued.received_ns, data)


def disagreeing_name(topic: Topic, key: str, message: Message) -> str | None:
    """Error text when the names in a message and in its key differ; None when they agree."""
    in_key = topic.names(key) or {}
    for field, value in topic.names_of(message).items():
        if in_key.get(field) != value:
            return f"{topic.name}: {field} = {value!r}, but {in_key.get(field)!r} in its key"
    return None


def outgoing(rig: str, topic: Topic, message: Message, names: dict[str, str]) -> tuple[str, bytes]:
    """Key and encoded bytes of a message.  Raises BadMessage and ValueError as `Bus.publish` does."""
    if type(message) is not topic.message:
        raise ValueError(f"{topic.name} carries {topic.message.__name__}, not {type(message).__name__}")
    key = topic.at(rig, **(topic.names_of(message) | names))
    disagreement = disagreeing_name(topic, key, message)
    if disagreement:
        raise ValueError(disagreement)
    return key, codec.encode(message)


def counts_as_sent(topic: Topic) -> bool:
    """Whether a message is in `Counters.sent`: those of LATCHED topics are sent again, and requests are of no service."""
    return topic.queueing is not Queueing.LATCHED and topic is not REQUEST


def check_key(rig: str, topic: Topic, key: str) -> None:
    """Raise ValueError unless `key` belongs to this topic and rig."""
    names = topic.names(key)
    if names is None or names["rig"] != rig:
        raise ValueError(f"{key}: no key of {topic.name} of rig {rig}, which are like {topic.on(rig)}")
