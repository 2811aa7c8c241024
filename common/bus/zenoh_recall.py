"""What a service said last outlives it: who heard it tells it to the one that starts in its place.

Of topics that are `recalled`, every reader keeps the last bytes of each key, and answers questions for them as long as
the service has spoken within REMEMBERED_S: after that, whoever starts is to begin anew.
"""

from collections.abc import Callable
from time import monotonic

import zenoh

from common import codec
from common.bus.inbox import Inbox
from common.messages import Message
from common.topics import RECALL, Topic

REMEMBERED_S = 60.0
MAX_KEYS = 64
QUESTION_S = 1.0  # longest wait for answers
Said = tuple[Topic, bytes, float]  # with the time of receipt, seconds


class Hearsay:
    """Of one reader.  rig: "*" for all.  now_s: seconds, never backwards."""

    def __init__(self, session: zenoh.Session, rig: str, now_s: Callable[[], float] = monotonic) -> None:
        self._session, self._rig, self._now_s = session, rig, now_s
        self._said: dict[str, Said] = {}
        self._served: zenoh.Queryable[None] | None = None

    def serve(self) -> None:
        """Answer from now on, until closed."""
        if self._served is None:
            self._served = self._session.declare_queryable(RECALL.format(rig=self._rig, topic="*"), self._answer)

    def close(self) -> None:
        if self._served is not None:
            self._served.undeclare()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"
            self._served = None

    def keep(self, key: str, topic: Topic, data: bytes) -> None:
        """On the thread that received it."""
        if key in self._said or len(self._said) < MAX_KEYS:
            self._said[key] = (topic, data, self._now_s())

    def last(self, key: str) -> bytes | None:
        """What was last said on `key`, if its service has said anything on a key beside it of late."""
        said = dict(self._said)
        speaker = key.rpartition("/")[0]
        heard_s = [at_s for other, (_, _, at_s) in said.items() if other.rpartition("/")[0] == speaker]
        if key not in said or self._now_s() - max(heard_s) > REMEMBERED_S:
            return None
        return said[key][1]

    def ask(self, topic: Topic, inbox: Inbox, now_ns: Callable[[], int]) -> None:
        """What was last said on the one key of `topic`; the newest answer, if any comes, is queued as if it came on it."""
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
            RECALL.format(rig=self._rig, topic=topic.name), zenoh.handlers.Callback(take, end),
            target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE, timeout=QUESTION_S, express=True,
        )  # fmt: skip

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            for key, (topic, _, _) in list(self._said.items()):
                asked = RECALL.format(rig=(topic.names(key) or {})["rig"], topic=topic.name)
                data = self.last(key) if query.key_expr.intersects(asked) else None
                if data is not None:
                    query.reply(asked, data, express=True)


def newest(answers: list[bytes], message: type[Message]) -> bytes | None:
    """That of the latest capture; None when none is a valid message of this type."""
    times: dict[int, bytes] = {}
    for data in answers:
        try:
            times[codec.decode(data, message).captured_ns] = data
        except codec.BadMessage:
            continue
    return times[max(times)] if times else None
