"""Waiting for readers without holding up the network: a service answers when it has handled what came before.

Each subscription of Zenoh's has its own thread, so a question may overtake the messages sent before it.  Therefore it
says how many there were, and the answer waits for them, for a moment: what the network has dropped never comes.
"""

import logging
import threading
from collections import Counter
from collections.abc import Collection, Mapping
from functools import partial
from time import monotonic

import zenoh

from common import codec
from common.bus.inbox import Inbox
from common.messages import PaceQuery

logger = logging.getLogger(__name__)

OVERTAKEN_S = 0.2  # longest wait for messages that a question has overtaken
MAX_KEYS = 1024


class Tally:
    """Counts what came for one inbox, by key, since the last question."""

    def __init__(self, inbox: Inbox) -> None:
        self.inbox = inbox
        self._changed = threading.Condition()
        self._heard: Counter[str] = Counter()
        self._expected: list[zenoh.KeyExpr] = []

    def expect(self, expression: str) -> None:
        """Messages of these keys are listened to."""
        with self._changed:
            self._expected.append(zenoh.KeyExpr(expression))

    def hear(self, key: str) -> None:
        """A message came, and is queued."""
        with self._changed:
            if key in self._heard or len(self._heard) < MAX_KEYS:
                self._heard[key] += 1
            self._changed.notify_all()

    def settle(self, sent: Mapping[str, int], end_s: float) -> dict[str, int]:
        """What of `sent` is listened to, once all of it has come, or at `end_s`; then counts anew."""
        with self._changed:
            expected = {key: count for key, count in sent.items() if self._listens(key)}
            self._changed.wait_for(
                lambda: all(self._heard[key] >= count for key, count in expected.items()), max(0.0, end_s - monotonic())
            )
            self._heard.clear()
            return expected

    def _listens(self, key: str) -> bool:
        return any(expression.includes(key) for expression in self._expected)


class Readers:
    """The inboxes of one service: its own, and those of its bus's readers, such as the log."""

    def __init__(self) -> None:
        self._tallies: list[Tally] = []
        self._lock = threading.Lock()

    def add(self, tally: Tally) -> None:
        with self._lock:
            self._tallies.append(tally)

    def remove(self, tally: Tally) -> None:
        """Its receiver is gone, or going: nobody is to wait for it."""
        with self._lock:
            self._tallies = [other for other in self._tallies if other is not tally]
        tally.inbox.release()

    def answer(self, query: zenoh.Query) -> None:
        """Reply to a `PaceQuery` when every reader has passed what was queued before it.  May wait: see OVERTAKEN_S."""
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
        heard: dict[str, int] = {}
        for tally in tallies:
            heard |= tally.settle(question.sent, end_s)
        answer = codec.encode(PaceQuery(frame=question.frame, captured_ns=question.captured_ns, sent=heard))
        left = set(range(len(tallies)))
        lock = threading.Lock()

        def passed(number: int) -> None:
            with lock:
                left.discard(number)
                done = not left
            if done:
                try:
                    query.reply(query.key_expr, answer, express=True)
                    query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
                except zenoh.ZError as error:
                    logger.debug("%s: the asker is gone: %s", query.key_expr, error)

        for number, tally in enumerate(tallies):
            tally.inbox.mark(partial(passed, number))


def ask_all(session: zenoh.Session, keys: Collection[str], question: PaceQuery, timeout_s: float) -> dict[str, PaceQuery]:
    """The answers by key, of those who gave one within `timeout_s`; returns when all have, or cannot."""
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
