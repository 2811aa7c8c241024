"""Flow control: a service replies to a query when it has handled all messages sent before it.

Each Zenoh subscription has its own thread, so a query may overtake the messages sent before it.  Therefore it contains
their number, and the reply waits for them, at most OVERTAKEN_S because dropped messages never arrive.
"""

import logging
import threading
from collections import Counter
from collections.abc import Collection, Mapping
from functools import partial
from time import monotonic

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.messages import PaceQuery

logger = logging.getLogger(__name__)

OVERTAKEN_S = 0.2  # longest wait for messages that a query has overtaken
MAX_KEYS = 1024


class Tally:
    """Number of messages received for one inbox, by key, since the last query."""

    def __init__(self, inbox: Inbox) -> None:
        self.inbox = inbox
        self._changed = threading.Condition()
        self._received: Counter[str] = Counter()
        self._expected: list[zenoh.KeyExpr] = []

    def expect(self, expression: str) -> None:
        """Add a subscription to `expression`."""
        with self._changed:
            self._expected.append(zenoh.KeyExpr(expression))

    def count(self, key: str) -> None:
        """Count a message that was received and queued."""
        with self._changed:
            if key in self._received or len(self._received) < MAX_KEYS:
                self._received[key] += 1
            self._changed.notify_all()

    def settle(self, sent: Mapping[str, int], end_s: float) -> dict[str, int]:
        """The subscribed part of `sent`, after all of it has arrived or at `end_s`; resets the counts."""
        with self._changed:
            expected = {key: count for key, count in sent.items() if self._is_subscribed(key)}
            self._changed.wait_for(
                lambda: all(self._received[key] >= count for key, count in expected.items()), max(0.0, end_s - monotonic())
            )
            self._received.clear()
            return expected

    def _is_subscribed(self, key: str) -> bool:
        return any(expression.includes(key) for expression in self._expected)


class Readers:
    """The inboxes of one service: its own, and those of the readers of its bus, such as the log."""

    def __init__(self) -> None:
        self._tallies: list[Tally] = []
        self._lock = threading.Lock()

    def add(self, tally: Tally) -> None:
        with self._lock:
            self._tallies.append(tally)

    def remove(self, tally: Tally) -> None:
        """Remove an inbox whose receiver ends, so that no query waits for it."""
        with self._lock:
            self._tallies = [other for other in self._tallies if other is not tally]
        tally.inbox.release()

    def answer(self, query: zenoh.Query) -> None:
        """Reply to a `PaceQuery` when every reader has handled what was queued before it.  May wait: see OVERTAKEN_S."""
        with self._lock:
            tallies = list(self._tallies)
        try:
            question = codec.decode(query.payload.to_bytes() if query.payload else b"", PaceQuery)
        except codec.BadMessage as error:
            for tally in tallies[:1]:
                tally.inbox.reject(str(query.key_expr), "invalid", str(error))
            query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
            return
        end_s = monotonic() + OVERTAKEN_S
        received: dict[str, int] = {}
        for tally in tallies:
            received |= tally.settle(question.sent, end_s)
        answer = codec.encode(PaceQuery(frame=question.frame, captured_ns=question.captured_ns, sent=received))
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
