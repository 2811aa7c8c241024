"""Bus over Zenoh.

Callbacks only enqueue.  Clock and state queries are answered immediately, flow-control queries after the queued messages.
Frames are dropped when a reader is slow (one frozen reader must not stall a rig) and sent without batching.
"""

import logging
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import zenoh
import zenoh.ext

from zenocap.common import codec
from zenocap.common.bus.certificate import Expiry
from zenocap.common.bus.inbox import Inbox, check_key, counts_as_sent, outgoing
from zenocap.common.bus.protocol import Alive, BusError, Counters, DuplicateService, Received
from zenocap.common.bus.zenoh_claims import Claims
from zenocap.common.bus.zenoh_flow_control import Readers, Tally, ask_all
from zenocap.common.bus.zenoh_queries import ENCODING, QUERY_TIMEOUT_S, ZenohClock, query_service_info, serve_service_info
from zenocap.common.bus.zenoh_query_server import QueryServer
from zenocap.common.bus.zenoh_session import Declared, Reach, ZenohOptions, close_session, open_session
from zenocap.common.bus.zenoh_state_recovery import RecoveryStore
from zenocap.common.closable import Closable
from zenocap.common.messages import FilmQuery, FilmReply, Message, PaceQuery, ServiceInfo
from zenocap.common.runtime.clock import Clock
from zenocap.common.topics import ALIVE, FILM, FLOW_CONTROL, ROOT, TOPICS, Queueing, Topic, checked_name, is_name, rig_of

logger = logging.getLogger(__name__)

HEARTBEAT_S = 1.0  # longest time until a reader detects that it missed the last value, chosen by hand
MAX_RIGS = 64  # that are found: a reader of each is opened; chosen by hand


class _Publisher(Declared, Protocol):
    def put(self, payload: bytes) -> None: ...


def in_order(on_sample: Callable[[zenoh.Sample], None]) -> "zenoh.handlers.Callback[zenoh.Sample]":
    """Handler of a subscriber that keeps the order in which a session sent messages of different topics.

    Zenoh's default calls each subscriber on a thread of its own: under load an answer overtook its question.  This one
    calls on the thread that receives from the network, so `on_sample` may only enqueue.
    """
    return zenoh.handlers.Callback(on_sample, indirect=False)


class ZenohBus(Closable):
    """See `zenocap.common.bus.protocol.Bus`.  To be used in a `with` statement: an open session keeps the process alive."""

    def __init__(
        self, session: zenoh.Session, rig: str, clock: Clock, *, readers: Readers | None = None,
        only: zenoh.KeyExpr | None = None, certificate: Path | None = None, connect: Collection[str] = (),
        own: Collection[tuple[str, str]] = (),
    ) -> None:  # fmt: skip
        """readers: of the parent bus, for a reader.  only: key expression of the keys received; required for rig "*".

        certificate: own one, whose expiry is counted.  connect: addresses of which one is to be reached.
        own: services of the rig, see `open`.
        """
        self._rig = rig if only is not None and rig == "*" else checked_name("rig", rig)
        self._only = only
        self._session = session
        self._owns_session = readers is None
        self._readers = readers or Readers()
        self._clock = clock
        self._own = own
        self._inbox = Inbox(logger, rig, own)
        self._round_trips = ZenohClock(session, rig, clock, self._inbox)
        self._tally = Tally(self._inbox, self._readers.changed)
        self._recovery = RecoveryStore(session, rig)
        self._readers.add(self._tally)
        self._publishers: dict[str, _Publisher] = {}
        self._declared: list[Declared] = []
        self._claims: list[Claims] = []
        self._reach = Reach(session, connect)
        self._duplicate: DuplicateService | None = None
        self._asked = 0
        self._expiry = Expiry(certificate, logger) if certificate is not None else None
        self._sent: Counter[str] = Counter()  # by key, since the last flow-control query
        self._sent_in_all: Counter[str] = Counter()  # by name of the topic

    @classmethod
    def open(
        cls, options: ZenohOptions, rig: str, clock: Clock, stopped: Callable[[], bool] = lambda: False,
        own: Collection[tuple[str, str]] = (),
    ) -> "ZenohBus":  # fmt: skip
        """own: services of the rig, by name and id: their messages are received whatever others send; see `Inbox`.

        Raises BusError as `open_session` does, and ValueError for a bad rig name.
        """
        checked_name("rig", rig)
        certificate = options.security.certificate if options.security else None
        session = open_session(options, stopped)
        return cls(session, rig, clock, certificate=certificate, connect=options.connect, own=own)

    @property
    def rig(self) -> str:
        return self._rig

    @property
    def counters(self) -> Counters:
        counters = replace(self._inbox.counters, sent=dict(self._sent_in_all))
        if self._expiry is None:
            return counters
        return replace(counters, certificate_days=self._expiry.days_left(self._clock.now_ns()))

    def publish(self, topic: Topic, message: Message, **names: str) -> None:
        key, data = outgoing(self._rig, topic, message, names)
        self._put(topic, key, data)

    def announce(self, topic: Topic, key: str) -> None:
        check_key(self._rig, topic, key)
        self._publisher(topic, key)

    def forward(self, topic: Topic, key: str, data: bytes) -> None:
        check_key(self._rig, topic, key)
        self._put(topic, key, data)

    def put(self, key: str, payload: bytes) -> None:
        """Send bytes on a key that is no topic's, for other programs; callable from any thread.

        Raises ValueError for a key of zenocap, BusError when the key cannot be used.
        """
        if key.split("/")[0] == ROOT:
            raise ValueError(f"{key}: allowed: a key that does not begin with {ROOT}/")
        try:
            self._session.put(key, payload, congestion_control=zenoh.CongestionControl.DROP, express=True)
        except zenoh.ZError as error:
            raise BusError(f"{key} cannot be published: {error}") from error

    def _put(self, topic: Topic, key: str, data: bytes) -> None:
        publisher = self._publisher(topic, key)
        try:
            publisher.put(data)
        except zenoh.ZError as error:
            raise BusError(f"{key} cannot be published: {error}") from error
        self._sent[key] += 1
        if counts_as_sent(topic):
            self._sent_in_all[topic.name] += 1

    def _publisher(self, topic: Topic, key: str) -> _Publisher:
        """Publisher of a key, declared with the first message.  Raises BusError."""
        if key not in self._publishers:
            try:
                if topic.queueing is Queueing.LATCHED:
                    self._publishers[key] = _latched_publisher(self._session, key)
                else:
                    self._publishers[key] = self._session.declare_publisher(
                        key, encoding=ENCODING, congestion_control=zenoh.CongestionControl.DROP, express=True
                    )
            except zenoh.ZError as error:
                raise BusError(f"{key} cannot be published: {error}") from error
        return self._publishers[key]

    def subscribe(self, topic: Topic, *, every: bool = False, **names: str) -> None:
        expression = topic.on(self._rig, **names)
        limit = codec.size_limit(topic.message)
        only = self._only
        if only is not None and not only.intersects(expression):
            return

        def queue(sample: zenoh.Sample) -> None:
            if sample.kind != zenoh.SampleKind.PUT or (only is not None and not only.includes(sample.key_expr)):
                return
            key, size = str(sample.key_expr), len(sample.payload)
            if size > limit:
                self._inbox.reject(key, "size", f"{size} bytes, more than {limit}")
            else:
                data = sample.payload.to_bytes()
                self._inbox.put(key, topic, data, self._clock.now_ns(), every=every)
                if topic.recoverable:
                    self._recovery.keep(key, topic, data)
            self._tally.count(topic, key)

        if topic.recoverable:
            self._recovery.serve()
        self._tally.expect(expression)
        if topic.queueing is Queueing.LATCHED:
            self._declared.append(_latched_subscriber(self._session, expression, in_order(queue)))
        else:
            self._declared.append(self._session.declare_subscriber(expression, in_order(queue)))

    def watch_alive(self) -> None:
        def queue(sample: zenoh.Sample) -> None:
            *_, service, id = str(sample.key_expr).split("/")
            if not (is_name(service) and is_name(id)):
                self._inbox.reject(str(sample.key_expr), "names", "no name of a service")
                return
            alive = sample.kind == zenoh.SampleKind.PUT
            self._inbox.put_event(Alive(service, id, alive, self._clock.now_ns()))

        services = ALIVE.format(rig=self._rig, service="*", id="*")
        self._declared.append(self._session.liveliness().declare_subscriber(services, queue, history=True))

    def declare_alive(self, service: str, id: str) -> None:
        names = {"rig": self._rig, "service": checked_name("service", service), "id": checked_name("id", id)}

        def stop() -> None:
            # Two that started at the same time, or on both sides of a cut network: the older one continues.
            self._duplicate = DuplicateService(self._rig, service, id)
            self._inbox.wake()

        claims = Claims(self._session, names, self._clock.now_ns(), stop)
        if claims.taken():
            raise DuplicateService(self._rig, service, id)
        self._claims.append(claims)
        self._declared += claims.declare()
        self._declared.append(self._session.liveliness().declare_token(ALIVE.format(**names)))
        self._declared.append(
            self._session.declare_queryable(FLOW_CONTROL.format(**names), self._readers.answer, complete=True)
        )

    def serve_service_info(self, about: ServiceInfo) -> None:
        """Answer service information queries with `about`."""
        self._declared.append(serve_service_info(self._session, self._rig, about))

    def serve_films(
        self, viewer: str, answer: Callable[[FilmQuery], FilmReply], idle: Callable[[], None], first: Callable[[], str]
    ) -> None:
        """Answer film queries to a viewer of this rig until `close`; see `QueryServer`."""
        key = FILM.format(rig=self._rig, viewer=checked_name("viewer", viewer))
        self._declared.append(QueryServer(self._session, key, FilmQuery, answer, idle, first))

    def query_service_info(self, timeout_s: float) -> dict[tuple[str, str], ServiceInfo | str]:
        """Information of each service of the rig, by name and id, or an error text; waits `timeout_s` at most."""
        return query_service_info(self._session, self._rig, timeout_s)

    def wait_until_handled(
        self, services: Collection[tuple[str, str]], timeout_s: float
    ) -> dict[tuple[str, str], frozenset[str]]:
        sent, self._sent = self._sent, Counter()
        keys = {FLOW_CONTROL.format(rig=self._rig, service=service, id=id): (service, id) for service, id in services}
        self._asked += 1
        question = PaceQuery(frame=self._asked, captured_ns=self._clock.now_ns(), sent=dict(sent))
        answers = ask_all(self._session, keys, question, timeout_s)
        return {keys[key]: frozenset(answer.sent) for key, answer in answers.items()}

    def serve_clock(self) -> None:
        self._declared.append(self._round_trips.serve())

    def query_clock(self) -> None:
        self._round_trips.query()

    def request_recovery(self, topic: Topic) -> None:
        self._recovery.ask(topic, self._inbox, self._clock.now_ns, self._round_trips.integrator_ns)

    def receive(self, timeout_s: float) -> Received | None:
        for claims in self._claims:
            claims.check()
        self._reach.check()
        event = None if self._duplicate else self._inbox.take(timeout_s)
        if self._duplicate:
            raise self._duplicate
        return event

    def wake(self) -> None:
        self._inbox.wake()

    def reader(self) -> "ZenohBus":
        return ZenohBus(self._session, self._rig, self._clock, readers=self._readers, only=self._only, own=self._own)

    def reader_of(self, rig: str) -> "ZenohBus":
        """A reader of another rig on the same connection.  Raises ValueError for a bad name."""
        return ZenohBus(self._session, checked_name("rig", rig), self._clock, readers=self._readers)

    def rigs(self) -> frozenset[str]:
        """Names of the rigs on the network with at least one service alive, MAX_RIGS at most."""
        services = ALIVE.format(rig="*", service="*", id="*")
        replies = self._session.liveliness().get(services, timeout=QUERY_TIMEOUT_S)
        names = {str(reply.ok.key_expr).split("/")[1] for reply in replies if reply.ok is not None}
        return frozenset(sorted(name for name in names if is_name(name))[:MAX_RIGS])

    def listener(self, expression: str) -> "ZenohBus":
        """A reader of the topics of all rigs, restricted to the keys that match a Zenoh key expression.

        Raises BusError for an invalid expression and for one that no topic can match.
        """
        try:
            only = zenoh.KeyExpr(expression)
        except zenoh.ZError as error:
            raise BusError(f"{expression!r} is no key expression: {str(error).split(' at /')[0]}") from error
        rig = rig_of(expression) or "*"
        if not any(only.intersects(topic.on(rig)) for topic in TOPICS):
            raise BusError(f"{expression}: matches no key of zenocap; allowed: such as zenocap/studio/**")
        return ZenohBus(self._session, rig, self._clock, readers=self._readers, only=only, own=self._own)

    def close(self) -> None:
        self._readers.remove(self._tally)
        self._claims.clear()
        declared, self._declared = self._declared, []
        publishers, self._publishers = list(self._publishers.values()), {}
        if self._owns_session:
            close_session(self._session, (self._recovery, *declared, *publishers))
            return
        # What was subscribed to last, such as the health in a log, ends first.
        for one in (self._recovery, *reversed(declared), *publishers):
            one.undeclare()


def _latched_publisher(session: zenoh.Session, key: str) -> zenoh.ext.AdvancedPublisher:
    """Publisher whose last value late joiners receive.  Raises ZError."""
    return zenoh.ext.declare_advanced_publisher(
        session, key, encoding=ENCODING, congestion_control=zenoh.CongestionControl.DROP,
        cache=zenoh.ext.CacheConfig(max_samples=1),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT_S, sporadic_heartbeat=None),
        publisher_detection=True,
    )  # fmt: skip


def _latched_subscriber(
    session: zenoh.Session, expression: str, on_sample: "zenoh.handlers.Callback[zenoh.Sample]"
) -> zenoh.ext.AdvancedSubscriber[None]:
    """Subscriber that also receives the last value.  on_sample: called with each sample, on a thread of Zenoh's."""
    return zenoh.ext.declare_advanced_subscriber(
        session, expression, on_sample, history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
        recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
    )  # fmt: skip
