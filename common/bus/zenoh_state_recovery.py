"""State recovery: readers return the last messages of a service to its successor.

Every reader keeps the last bytes of each key of `recoverable` topics and replies to queries for them until the service has
published nothing for RETENTION_S: a service that starts later begins without state.
"""

from collections.abc import Callable
from time import monotonic

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.messages import Message
from zenocap.common.topics import STATE_RECOVERY, Topic

RETENTION_S = 60.0  # chosen by hand
MAX_KEYS = 64
QUERY_TIMEOUT_S = 1.0  # chosen by hand
Stored = tuple[Topic, bytes, float]  # with the time of receipt, seconds


class RecoveryStore:
    """The last messages that one reader has received.  rig: "*" for all.  now_s: monotonic time, seconds."""

    def __init__(self, session: zenoh.Session, rig: str, now_s: Callable[[], float] = monotonic) -> None:
        self._session, self._rig, self._now_s = session, rig, now_s
        self._stored: dict[str, Stored] = {}
        self._served: zenoh.Queryable[None] | None = None

    def serve(self) -> None:
        """Reply to queries until closed."""
        if self._served is None:
            self._served = self._session.declare_queryable(STATE_RECOVERY.format(rig=self._rig, topic="*"), self._answer)

    def close(self) -> None:
        if self._served is not None:
            self._served.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
            self._served = None

    def keep(self, key: str, topic: Topic, data: bytes) -> None:
        """Store a message; called on the thread that received it."""
        if key in self._stored or len(self._stored) < MAX_KEYS:
            self._stored[key] = (topic, data, self._now_s())

    def last(self, key: str) -> bytes | None:
        """The last bytes of `key`; None when its service published nothing within REMEMBERED_S."""
        stored = dict(self._stored)
        service = key.rpartition("/")[0]
        received_s = [at_s for other, (_, _, at_s) in stored.items() if other.rpartition("/")[0] == service]
        if key not in stored or self._now_s() - max(received_s) > RETENTION_S:
            return None
        return stored[key][1]

    def ask(self, topic: Topic, inbox: Inbox, now_ns: Callable[[], int]) -> None:
        """Query for the last message on the one key of `topic`; the newest reply is queued as if it was published."""
        key, answers = topic.at(self._rig), list[bytes]()
        limit = codec.size_limit(topic.message)

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None and len(reply.ok.payload) <= limit:
                answers.append(reply.ok.payload.to_bytes())

        def end() -> None:
            found = newest(answers, topic.message)
            if found is not None:
                inbox.put(key, topic, found, now_ns(), every=False)

        self._session.get(
            STATE_RECOVERY.format(rig=self._rig, topic=topic.name), zenoh.handlers.Callback(take, end),
            target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE, timeout=QUERY_TIMEOUT_S, express=True,
        )  # fmt: skip

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            for key, (topic, _, _) in list(self._stored.items()):
                expression = STATE_RECOVERY.format(rig=(topic.names(key) or {})["rig"], topic=topic.name)
                data = self.last(key) if query.key_expr.intersects(expression) else None
                if data is not None:
                    query.reply(expression, data, express=True)


def newest(answers: list[bytes], message: type[Message]) -> bytes | None:
    """The reply with the latest capture time; None without a valid message of this type."""
    times: dict[int, bytes] = {}
    for data in answers:
        try:
            times[codec.decode(data, message).captured_ns] = data
        except codec.BadMessage:
            continue
    return times[max(times)] if times else None
