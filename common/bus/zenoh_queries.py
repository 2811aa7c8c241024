"""Queries that are answered on Zenoh's threads: the integrator's clock, service information."""

import logging
from itertools import islice
from typing import TypeVar

import zenoh

from zenocap.common import codec
from zenocap.common.bus.inbox import Inbox
from zenocap.common.bus.protocol import RoundTrip
from zenocap.common.messages import ClockQuery, Message, ServiceInfo
from zenocap.common.runtime.clock import Clock
from zenocap.common.topics import CLOCK, SERVICE_INFO

logger = logging.getLogger(__name__)

R = TypeVar("R", bound=Message)

ENCODING = "application/msgpack"
QUERY_TIMEOUT_S = 1.0  # of a round trip, chosen by hand
MAX_REPLIES = 256  # largest number read for one query


class ZenohClock:
    """Round trips to the integrator's clock.  Results and invalid queries go to `inbox`."""

    def __init__(self, session: zenoh.Session, rig: str, clock: Clock, inbox: Inbox) -> None:
        self._session, self._clock, self._inbox = session, clock, inbox
        self._key = CLOCK.format(rig=rig)
        self._queries = 0
        self._ahead_ns = 0  # the integrator's clock minus this one by the last round trip, which is good to half its time

    def integrator_ns(self) -> int:
        """Time by the integrator's clock; by this one before the first round trip."""
        return self._clock.now_ns() + self._ahead_ns

    def serve(self) -> zenoh.Queryable[None]:
        """Reply with this clock until the returned queryable is undeclared."""
        return self._session.declare_queryable(self._key, self._reply, complete=True)

    def query(self) -> None:
        """Start one round trip; a `RoundTrip` is queued when all have answered.

        Of several, as others may answer too, the time that can differ least from this clock is used: equal clocks stay so.
        """
        sent_ns = self._clock.now_ns()
        frame = self._queries = self._queries + 1
        nearest: list[RoundTrip] = []  # two at most

        def take(reply: zenoh.Reply) -> None:
            received_ns = self._clock.now_ns()
            answer = None if reply.ok is None else self._decoded(self._key, reply.ok.payload.to_bytes())
            if answer is not None and answer.frame == frame:
                trips = (*nearest, RoundTrip(sent_ns, answer.captured_ns, received_ns))
                of_times = {trip.answered_ns: trip for trip in trips}
                nearest[:] = sorted(of_times.values(), key=lambda one: abs(one.ahead_ns) + one.received_ns // 2)[:2]

        def end() -> None:
            if len(nearest) > 1:
                self._inbox.reject(self._key, "names", f"{self._key}: several programs answer: the nearest time is used")
            if nearest:
                self._ahead_ns = nearest[0].ahead_ns
                self._inbox.put_event(nearest[0])

        payload = codec.encode(ClockQuery(frame=frame, captured_ns=sent_ns))
        self._session.get(
            self._key, zenoh.handlers.Callback(take, end), payload=payload, encoding=ENCODING, timeout=QUERY_TIMEOUT_S,
            target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE, express=True,
        )  # fmt: skip

    def _reply(self, query: zenoh.Query) -> None:
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


def serve_service_info(session: zenoh.Session, rig: str, info: ServiceInfo) -> zenoh.Queryable[None]:
    """Reply with `info` until the returned queryable is undeclared."""
    payload = codec.encode(info)
    key = SERVICE_INFO.format(rig=rig, service=info.service, id=info.id)

    def reply(query: zenoh.Query) -> None:
        with query:
            try:
                query.reply(key, payload, encoding=ENCODING)
            except zenoh.ZError as error:
                logger.debug("%s: the querying process is gone: %s", key, error)

    return session.declare_queryable(key, reply, complete=True)


def query_service_info(session: zenoh.Session, rig: str, timeout_s: float) -> dict[tuple[str, str], ServiceInfo | str]:
    """Service information of all services of a rig that reply within `timeout_s`, by name and id.

    The value is an error text where a reply is invalid.
    """
    found: dict[tuple[str, str], ServiceInfo | str] = {}
    for key, some in replies(session, SERVICE_INFO.format(rig=rig, service="*", id="*"), ServiceInfo, timeout_s).items():
        *_, service, id = key.split("/")
        info = some[-1]
        if not isinstance(info, str) and (info.service, info.id) != (service, id):
            info = f"the reply names {info.service} {info.id}"
        found[(service, id)] = info
    return found


def replies(
    session: zenoh.Session, expression: str, kind: type[R], timeout_s: float, payload: bytes = b""
) -> dict[str, list[R | str]]:
    """Replies by key, MAX_REPLIES at most: of all who answer; an error text where one is invalid."""
    found: dict[str, list[R | str]] = {}
    answers = session.get(
        expression, payload=payload, encoding=ENCODING, timeout=timeout_s, target=zenoh.QueryTarget.ALL,
        consolidation=zenoh.ConsolidationMode.NONE, express=True,
    )  # fmt: skip
    for answer in islice((one.ok for one in answers if one.ok is not None), MAX_REPLIES):
        message: R | str
        try:
            message = codec.decode(answer.payload.to_bytes(), kind)
        except codec.BadMessage as error:
            message = str(error)
        found.setdefault(str(answer.key_expr), []).append(message)
    return found
