"""Round trips to the integrator's clock over Zenoh: asked by all others, answered at once on Zenoh's thread."""

import zenoh

from common import codec
from common.bus.inbox import Inbox
from common.bus.protocol import RoundTrip
from common.messages import ClockQuery
from common.runtime.clock import Clock
from common.topics import CLOCK

ENCODING = "application/msgpack"
QUERY_TIMEOUT_S = 1.0


class ZenohClock:
    """Of one rig; round trips and bad questions go to `inbox`."""

    def __init__(self, session: zenoh.Session, rig: str, clock: Clock, inbox: Inbox) -> None:
        self._session, self._clock, self._inbox = session, clock, inbox
        self._key = CLOCK.format(rig=rig)
        self._asked = 0

    def serve(self) -> zenoh.Queryable[None]:
        """Answer until what is returned is undeclared."""
        return self._session.declare_queryable(self._key, self._answer, complete=True)

    def ask(self) -> None:
        """Start one round trip."""
        sent_ns = self._clock.now_ns()
        self._asked += 1
        frame = self._asked

        def take(reply: zenoh.Reply) -> None:
            received_ns = self._clock.now_ns()
            if reply.ok is None:
                return
            answer = self._decoded(str(reply.ok.key_expr), reply.ok.payload.to_bytes())
            if answer is not None and answer.frame == frame:
                self._inbox.put_event(RoundTrip(sent_ns, answer.captured_ns, received_ns))

        question = codec.encode(ClockQuery(frame=frame, captured_ns=sent_ns))
        self._session.get(self._key, take, payload=question, encoding=ENCODING, timeout=QUERY_TIMEOUT_S, express=True)

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            question = self._decoded(str(query.key_expr), query.payload.to_bytes() if query.payload else b"")
            if question is not None:
                reply = ClockQuery(frame=question.frame, captured_ns=self._clock.now_ns())
                query.reply(query.key_expr, codec.encode(reply), encoding=ENCODING, express=True)

    def _decoded(self, key: str, data: bytes) -> ClockQuery | None:
        try:
            return codec.decode(data, ClockQuery)
        except codec.BadMessage as error:
            self._inbox.reject(key, "invalid", str(error))
            return None
