"""Flow control: a service replies to a query when it has handled all messages sent before it.

Each Zenoh subscription has its own thread, so a query may overtake the messages sent before it.  Therefore it contains
their number, and the reply waits for them, at most OVERTAKEN_S because dropped messages never arrive.  Queries wait beside
each other: one that names messages that were never sent delays no other, such as that of `zenocap health`.
"""

import logging
import threading
from collections import Counter, deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import partial
from time import monotonic

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.messages import PaceQuery
from zenocap.common.topics import Topic

logger = logging.getLogger(__name__)

OVERTAKEN_S = 0.2  # longest wait for messages that a query has overtaken
MAX_KEYS = 1024  # that are counted, besides those of the rig's own services
MAX_WAITING = 256  # queries that wait at a time; the oldest one then waits no longer; chosen by hand


class Tally:
    """Number of messages received for one inbox, by key, since the last query.

    changed: notified with every message; it guards the counts.
    """

    def __init__(self, inbox: Inbox, changed: threading.Condition) -> None:
        self.inbox = inbox
        self._changed = changed
        self._received: Counter[str] = Counter()
        self._expected: list[zenoh.KeyExpr] = []

    def expect(self, expression: str) -> None:
        """Add a subscription to `expression`."""
        with self._changed:
            self._expected.append(zenoh.KeyExpr(expression))

    def count(self, topic: Topic, key: str) -> None:
        """Count a message that was received and queued."""
        with self._changed:
            if key in self._received or len(self._received) < MAX_KEYS or self.inbox.is_own(topic, key):
                self._received[key] += 1
            self._changed.notify_all()

    def subscribed(self, sent: Mapping[str, int]) -> dict[str, int]:
        """The part of `sent` that this inbox subscribes to."""
        return {key: count for key, count in sent.items() if any(one.includes(key) for one in self._expected)}

    def has(self, expected: Mapping[str, int]) -> bool:
        """Whether that many messages have arrived.  The caller holds `changed`."""
        return all(self._received[key] >= count for key, count in expected.items())

    def clear(self) -> None:
        """Reset the counts.  The caller holds `changed`."""
        self._received.clear()


@dataclass
class _Waiting:
    """A query, and the messages that each reader is to receive before.  end_s: monotonic time of the end of the wait."""

    query: zenoh.Query
    asked: PaceQuery
    expected: list[tuple[Tally, dict[str, int]]]
    end_s: float


class Readers:
    """The inboxes of one service: its own, and those of the readers of its bus, such as the log."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self._tallies: list[Tally] = []
        self._waiting: deque[_Waiting] = deque()
        self._waits = False  # whether the thread runs that waits for messages

    def add(self, tally: Tally) -> None:
        with self.changed:
            self._tallies.append(tally)

    def remove(self, tally: Tally) -> None:
        """Remove an inbox whose receiver ends, so that no query waits for it."""
        with self.changed:
            self._tallies = [other for other in self._tallies if other is not tally]
        tally.inbox.release()

    def answer(self, query: zenoh.Query) -> None:
        """Reply to a `PaceQuery` when every reader has handled what was queued before it.  Does not wait."""
        with self.changed:
            tallies = list(self._tallies)
        try:
            question = codec.decode(query.payload.to_bytes() if query.payload else b"", PaceQuery)
        except codec.BadMessage as error:
            for tally in tallies[:1]:
                tally.inbox.reject(str(query.key_expr), "invalid", str(error))
            query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
            return
        with self.changed:
            expected = [(tally, tally.subscribed(question.sent)) for tally in tallies]
            waiting = _Waiting(query, question, expected, monotonic() + OVERTAKEN_S)
            if len(self._waiting) >= MAX_WAITING:
                self._waiting[0].end_s = 0.0
            self._waiting.append(waiting)
            if self._waits:
                self.changed.notify_all()
                return
            ready = self._ready()
            if self._waiting:
                self._waits = True
                threading.Thread(target=self._wait, name="flow control", daemon=True).start()
        for one in ready:
            self._mark(one)

    def _wait(self) -> None:
        """Pass the waiting queries on as their messages arrive; ends when none is left."""
        while True:
            with self.changed:
                ready = self._ready()
                if not ready:
                    if not self._waiting:
                        self._waits = False
                        return
                    next_s = min(one.end_s for one in self._waiting)
                    self.changed.wait(max(0.0, next_s - monotonic()))
            for one in ready:
                self._mark(one)

    def _ready(self) -> list[_Waiting]:
        """Remove the queries whose messages have arrived, or whose time is over.  The caller holds `changed`."""
        now_s = monotonic()
        ready = [
            one
            for one in self._waiting
            if now_s >= one.end_s or all(tally.has(expected) for tally, expected in one.expected)
        ]
        for one in ready:
            self._waiting.remove(one)
            for tally, _ in one.expected:
                tally.clear()
        return ready

    def _mark(self, waiting: _Waiting) -> None:
        """Reply once every reader has handled what it has received by now."""
        query, question = waiting.query, waiting.asked
        received: dict[str, int] = {}
        for _, expected in waiting.expected:
            received |= expected
        answer = codec.encode(PaceQuery(frame=question.frame, captured_ns=question.captured_ns, sent=received))
        with self.changed:
            tallies = [tally for tally, _ in waiting.expected if tally in self._tallies]
        pending = set(range(len(tallies)))
        lock = threading.Lock()

        def passed(number: int) -> None:
            with lock:
                pending.discard(number)
                done = not pending
            if done:
                try:
                    query.reply(query.key_expr, answer, express=True)
                    query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
                except zenoh.ZError as error:
                    logger.debug("%s: the querying process is gone: %s", query.key_expr, error)

        for number, tally in enumerate(tallies):
            tally.inbox.mark(partial(passed, number))


def ask_all(session: zenoh.Session, keys: Collection[str], question: PaceQuery, timeout_s: float) -> dict[str, PaceQuery]:
    """Replies that arrive within `timeout_s`, by key; returns earlier when all have replied or failed."""
    changed = threading.Condition()
    answers: dict[str, PaceQuery] = {}
    waiting = set(keys)
    payload = codec.encode(question)

    def ask(key: str) -> None:
        def take(reply: zenoh.Reply) -> None:
            if reply.ok is None:
                return
            try:
                answer = codec.decode(reply.ok.payload.to_bytes(), PaceQuery)
            except codec.BadMessage as error:
                logger.warning("%s: %s", key, error)
                return
            with changed:
                answers[key] = answer

        def end() -> None:
            with changed:
                waiting.discard(key)
                changed.notify()

        session.get(key, zenoh.handlers.Callback(take, end), payload=payload, timeout=timeout_s, express=True)

    for key in keys:
        ask(key)
    with changed:
        changed.wait_for(lambda: not waiting, timeout_s + 1.0)
        return dict(answers)
