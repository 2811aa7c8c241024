"""Queries on one key, answered on a thread of their own, because the answers open files."""

import logging
import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Generic, TypeVar

import zenoh

from zenocap.common import codec
from zenocap.common.bus.zenoh_queries import ENCODING
from zenocap.common.messages import Message
from zenocap.common.runtime.logs import OncePerSource

logger = logging.getLogger(__name__)

WAITING = 32  # queries that wait for their answer, of the first and of others; more are not answered; chosen by hand
IDLE_S = 0.25  # between calls of `idle`; chosen by hand
ANSWER_S = 5.0  # to end an answer, at the end; chosen by hand

Q = TypeVar("Q", bound=Message)


class QueryServer(Generic[Q]):
    """Answers the queries on one key until `undeclare`.

    kind: of the queries.  answer, idle: called on one thread; idle every IDLE_S s at least.
    first: name in those that come before all others, which any program may send without end; "" for none.
    """

    def __init__(
        self, session: zenoh.Session, key: str, kind: type[Q], answer: Callable[[Q], Message],
        idle: Callable[[], None] = lambda: None, first: Callable[[], str] = str,
    ) -> None:  # fmt: skip
        self._kind, self._answer, self._idle, self._first, self._key = kind, answer, idle, first, key
        self._queue = queue.PriorityQueue[tuple[bool, int, zenoh.Query | None]]()  # whether of others, number; None: end
        self._number = count()
        self._log_once = OncePerSource(logger)
        self._thread = threading.Thread(target=self._work, name=f"answer {key}", daemon=True)
        self._thread.start()
        self._queryable = session.declare_queryable(key, self._enqueue, complete=True)

    def undeclare(self) -> None:
        try:
            self._queryable.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
        finally:
            self._queue.put((False, -1, None))
            self._thread.join(ANSWER_S)

    def _enqueue(self, query: zenoh.Query) -> None:
        first, payload = self._first().encode(), query.payload
        other = not (first and payload and len(payload) <= codec.size_limit(self._kind) and first in payload.to_bytes())
        if self._queue.qsize() < (WAITING if other else 2 * WAITING):
            self._queue.put((other, next(self._number), query))
        else:
            query.drop()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"

    def _work(self) -> None:
        while True:
            try:
                with suppress(queue.Empty):
                    _, _, query = self._queue.get(timeout=IDLE_S)
                    if query is None:
                        return
                    with query:
                        self._reply(query)
                self._idle()
            except Exception as error:  # one bad query must not end the answers: a film could not be stopped any more
                self._log_once.warn(self._key, "failed", f"{self._key}: {type(error).__name__}: {error}", trace=True)

    def _reply(self, query: zenoh.Query) -> None:
        payload, limit = query.payload, codec.size_limit(self._kind)
        if payload is not None and len(payload) > limit:
            self._log_once.warn(self._key, "size", f"{self._key}: {len(payload)} bytes, more than {limit}")
            return
        try:
            reply = codec.encode(self._answer(codec.decode(payload.to_bytes() if payload else b"", self._kind)))
        except codec.BadMessage as error:
            self._log_once.warn(self._key, "invalid", f"{self._key}: {error}")
            return
        try:
            query.reply(self._key, reply, encoding=ENCODING)
        except zenoh.ZError as error:
            logger.debug("%s: the querying process is gone: %s", self._key, error)
