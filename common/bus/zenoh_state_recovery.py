"""State recovery: readers return the last messages of a service to its successor.

Every reader keeps the last bytes of each key of `recoverable` topics and replies to queries for them until the service has
published nothing for RETENTION_S.  A service that starts later begins without state.

The reply becomes the body and pose of the successor.  Each session therefore counts once, the value that most sessions
return is used, and one captured in the future is not.  With certificates, viewers and readers cannot reply at all.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from time import monotonic

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.messages import Message
from zenocap.common.topics import STATE_RECOVERY, Topic

RETENTION_S = 60.0  # chosen by hand
MAX_KEYS = 64
QUERY_TIMEOUT_S = 1.0  # chosen by hand
MAX_REPLIES = 64  # of one query, which bounds the memory; a rig has a dozen readers; chosen by hand
FUTURE_NS = 2_000_000_000  # greatest lead of a capture time over the integrator's clock; chosen by hand
Stored = tuple[Topic, bytes, float]  # with the time of receipt, seconds


class RecoveryStore:
    """The last messages that one reader has received.  rig: "*" for all.  now_s: monotonic time, seconds."""

    def __init__(self, session: zenoh.Session, rig: str, now_s: Callable[[], float] = monotonic) -> None:
        self._session, self._rig, self._now_s = session, rig, now_s
        self._stored: dict[str, Stored] = {}
        self._served: zenoh.Queryable[None] | None = None

    def serve(self) -> None:
        """Reply to queries until `undeclare`."""
        if self._served is None:
            self._served = self._session.declare_queryable(STATE_RECOVERY.format(rig=self._rig, topic="*"), self._answer)

    def undeclare(self) -> None:
        if self._served is not None:
            self._served.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
            self._served = None

    def keep(self, key: str, topic: Topic, data: bytes) -> None:
        """Store a message; called on the thread that received it."""
        if key in self._stored or len(self._stored) < MAX_KEYS:
            self._stored[key] = (topic, data, self._now_s())

    def last(self, key: str) -> bytes | None:
        """The last bytes of `key`; None when its service published nothing within RETENTION_S."""
        stored = dict(self._stored)
        service = key.rpartition("/")[0]
        received_s = [at_s for other, (_, _, at_s) in stored.items() if other.rpartition("/")[0] == service]
        if key not in stored or self._now_s() - max(received_s) > RETENTION_S:
            return None
        return stored[key][1]

    def ask(
        self, topic: Topic, inbox: Inbox, now_ns: Callable[[], int], integrator_ns: Callable[[], int] | None = None
    ) -> None:
        """Query for the last message on the one key of `topic`; the agreed reply is queued as if it was published.

        integrator_ns: the integrator's clock, which capture times are on; default: `now_ns`, this machine's.
        """
        integrator_ns = integrator_ns or now_ns
        key, expression = topic.at(self._rig), STATE_RECOVERY.format(rig=self._rig, topic=topic.name)
        answers: list[tuple[str, bytes]] = []
        limit = codec.size_limit(topic.message)

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is None or len(answers) >= MAX_REPLIES or str(reply.ok.key_expr) != expression:
                return
            if len(reply.ok.payload) <= limit:
                replier = "" if reply.replier_id is None else str(reply.replier_id.zid)
                answers.append((replier, reply.ok.payload.to_bytes()))

        def end() -> None:
            found = agreed(answers, topic.message, integrator_ns() + FUTURE_NS)
            if found is not None:
                inbox.put(key, topic, found, now_ns(), every=False)

        self._session.get(
            expression, zenoh.handlers.Callback(take, end),
            target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE, timeout=QUERY_TIMEOUT_S, express=True,
        )  # fmt: skip

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            for key, (topic, _, _) in list(self._stored.items()):
                expression = STATE_RECOVERY.format(rig=(topic.names(key) or {})["rig"], topic=topic.name)
                data = self.last(key) if query.key_expr.intersects(expression) else None
                if data is not None:
                    query.reply(expression, data, express=True)


def agreed(replies: Iterable[tuple[str, bytes]], message: type[Message], latest_ns: int) -> bytes | None:
    """The value that most sessions return, of equally frequent ones the latest captured; None without a valid one.

    replies: session and bytes; of several valid ones of a session the latest captured counts.  latest_ns: a message that
    was captured after it is invalid.
    """
    by_session: dict[str, tuple[int, bytes]] = {}
    for session, data in replies:
        try:
            captured_ns = codec.decode(data, message).captured_ns
        except codec.BadMessage:
            continue
        if captured_ns <= latest_ns and captured_ns >= by_session.get(session, (0, b""))[0]:
            by_session[session] = (captured_ns, data)
    votes = Counter(by_session.values())
    return max(votes, key=lambda value: (votes[value], value))[1] if votes else None
