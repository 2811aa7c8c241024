"""The one service loop: events in, pure step, messages out.

A service is its `step(setup, state, event) -> (state, messages)`.  The loop feeds it frames, envelopes, alive changes
and ticks from one thread, publishes what it returns, measures, and says so at 1 Hz.
"""

import logging
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeAlias, TypeVar

from common.bus.protocol import Alive, Bus, BusError, Envelope, FrameLike, Received, RoundTrip, Tick
from common.messages import Message
from common.runtime.clock import Clock, ClockFilter, observe, offset_at
from common.runtime.frames import NewestFrame
from common.runtime.handled import Trace, in_words, kind_of
from common.runtime.health import Meter
from common.runtime.logs import OncePerSource
from common.runtime.questions import Questions
from common.topics import Topic, topic_of

logger = logging.getLogger(__name__)

HEALTH_NS = 1_000_000_000
BATCH = 256  # messages before a waiting frame gets its turn
WAIT_S = 0.1  # longest wait for an event, so that signals are heeded


Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)
Event: TypeAlias = F | Envelope | Alive | Tick
Step: TypeAlias = Callable[[Setup, State, Event[F]], tuple[State, Sequence[Message]]]


@dataclass(frozen=True)
class Subscription:
    """names: who to listen to, all if left out.  every: each message in order, also of a LATEST topic."""

    topic: Topic
    every: bool = False
    names: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Service(Generic[Setup, State, F]):
    """name, id: as in its health and liveliness.  describe: the state in words.  count: what the state has counted.

    tick_ns: feed a Tick at this period, 0 for never.  keeps_time: this is the integrator, whose clock the others use.
    pending: whether the state has work that a Tick is to start, once everything that has come is handled.
    result: messages whose age since their capture is a stage of the health.
    recalls: topics of its own, of which the state lacks what was said before a restart: it is asked for, and fed.
    derives: it says what it was fed, so that what it said can be recomputed; False for one that only shows.
    max_failures: steps that may fail in a row before the service gives up, those on messages left out: what others send
    ends no service.
    """

    name: str
    id: str
    setup: Setup
    state: State
    step: Step[Setup, State, F]
    subscriptions: tuple[Subscription, ...] = ()
    describe: Callable[[State], str] = lambda state: type(state).__name__
    count: Callable[[State], Mapping[str, int]] = lambda state: {}
    watch_alive: bool = False
    tick_ns: int = 0
    pending: Callable[[State], bool] = lambda state: False
    recalls: Callable[[State], Collection[Topic]] = lambda state: ()
    result: type[Message] | None = None
    keeps_time: bool = False
    derives: bool = True
    max_failures: int = 10


class GivingUp(Exception):
    """The step failed too often in a row."""


class Runner(Generic[Setup, State, F]):
    """One service on one bus: the state, and what happens with one event.  Used by `run`, and alone offline."""

    def __init__(self, service: Service[Setup, State, F], bus: Bus, clock: Clock) -> None:
        self.service = service
        self.bus = bus
        self.clock = clock
        self.state = service.state
        self.meter = Meter(service.name, service.id)
        self._trace = Trace(service.name, service.id)
        self._failures = 0
        self._once = OncePerSource(logger)

    def subscribe(self) -> None:
        for subscription in self.service.subscriptions:
            self.bus.subscribe(subscription.topic, every=subscription.every, **subscription.names)
        if self.service.watch_alive:
            self.bus.watch_alive()

    def handle(self, event: Event[F]) -> None:
        """One step and its messages.  Raises GivingUp after `max_failures` failures in a row, messages left out."""
        kind, source = kind_of(event), in_words(event)
        if self.service.derives:
            if self._trace.full:
                self.report_handled()
            self._trace.add(event)
        started_ns = self.clock.elapsed_ns()
        try:
            self.state, messages = self.service.step(self.service.setup, self.state, event)
        except Exception as error:  # one bad frame must not end a take; the state before it is kept
            self._failures += not isinstance(event, Envelope)
            self.meter.counts["step_errors"] += 1
            self._once.warn(kind, "step", f"step failed on {source}: {type(error).__name__}: {error}", trace=True)
            if self._failures >= self.service.max_failures:
                raise GivingUp(f"{self._failures} steps in a row failed, the last on {source}: {error}") from error
            return
        self._failures = 0
        stepped_ns = self.clock.elapsed_ns()
        self.meter.time(f"step_{kind}", stepped_ns - started_ns)
        for message in messages:
            topic = self.publish(message)
            if topic is not None:
                self.meter.publish(topic.name)
            if self.service.result is not None and isinstance(message, self.service.result):
                self.meter.time("result_age", self.clock.now_ns() - message.captured_ns)
        if messages:
            self.meter.time("publish", self.clock.elapsed_ns() - stepped_ns)
        if not isinstance(event, Envelope | Alive | Tick):
            self.meter.frame()
            self.meter.time("frame_age", self.clock.now_ns() - event.captured_ns)

    @property
    def pending(self) -> bool:
        """Whether a Tick is due, once everything that has come is handled."""
        return self.service.pending(self.state)

    def report_handled(self) -> None:
        """Say what was handled since the last time, so that a take of it can be recomputed."""
        handled = self._trace.report(self.clock.now_ns())
        if handled is not None:
            self.publish(handled)

    def publish(self, message: Message) -> Topic | None:
        """Send a message on its topic; None when it may not be sent, which is counted and logged."""
        try:
            topic = topic_of(type(message))
            self.bus.publish(topic, message)
            return topic
        except ValueError as error:  # BadMessage is one
            self.meter.counts["unsendable"] += 1
            self._once.warn(type(message).__name__, "unsendable", str(error))
            return None


def run(
    service: Service[Setup, State, F],
    bus: Bus,
    clock: Clock,
    source: Iterator[F] | None = None,
    stopped: Callable[[], bool] = lambda: False,
    extra_counts: Callable[[], Mapping[str, int]] = dict,
    greeting: Sequence[Message] = (),
    asked: Callable[[], Sequence[Message]] = tuple,
    shown: Callable[[State], None] = lambda _: None,
) -> int:
    """Run until `stopped` or the end of `source`; exit status 0, or 1 after a failure, which is logged.

    extra_counts: counts of others for this service's health, such as those of its log.
    greeting: messages to publish at the start, once nobody else is found to run this service.
    asked: messages of other threads to publish; they call `bus.wake()` to have it asked at once.
    shown: gets the state whenever everything that has come is handled.
    """
    runner = Runner(service, bus, clock)
    frames = NewestFrame(source, bus.wake) if source is not None else None
    try:
        bus.declare_alive(service.name, service.id)
        if service.keeps_time:
            bus.serve_clock()
        runner.subscribe()
        for message in greeting:
            runner.publish(message)
        if frames:
            frames.start()
        _loop(runner, frames, stopped, extra_counts, asked, shown)
        runner.report_handled()
    except (BusError, GivingUp) as error:
        logger.error("%s", error)
        return 1
    finally:
        if frames:
            frames.stop()
    if frames and frames.failure:
        logger.error("the frame source failed: %s: %s", type(frames.failure).__name__, frames.failure)
        return 1
    return 0


def _loop(
    runner: Runner[Setup, State, F],
    frames: NewestFrame[F] | None,
    stopped: Callable[[], bool],
    extra_counts: Callable[[], Mapping[str, int]],
    asked: Callable[[], Sequence[Message]],
    shown: Callable[[State], None],
) -> None:
    service, bus, clock = runner.service, runner.bus, runner.clock
    trips = ClockFilter()
    health_ns = tick_ns = clock.elapsed_ns()
    questions = Questions(bus, health_ns, keeps_time=service.keeps_time)
    while not stopped() and not (frames and frames.ended):
        now_ns = clock.elapsed_ns()
        questions.ask(now_ns, service.recalls(runner.state))
        if now_ns >= health_ns:
            if frames:
                runner.meter.counts["dropped_frames"] = frames.dropped
            offset = offset_at(trips, clock.now_ns())
            for name, count in (*extra_counts().items(), *service.count(runner.state).items()):
                runner.meter.counts[name] = count  # a Counter's update would add
            words = service.describe(runner.state)
            runner.publish(runner.meter.report(clock.now_ns(), now_ns, words, bus.counters, offset))
            runner.report_handled()
            health_ns = max(health_ns + HEALTH_NS, now_ns)
        if service.tick_ns and now_ns >= tick_ns:
            runner.handle(Tick(clock.now_ns()))
            tick_ns = max(tick_ns + service.tick_ns, now_ns)
        wait_s = 0.0 if runner.pending else min(WAIT_S, service.tick_ns / 1e9 or WAIT_S)
        for event in _receive(bus, wait_s):
            if isinstance(event, RoundTrip):
                trips = observe(trips, event)
            else:
                runner.handle(event)
        if runner.pending:
            runner.handle(Tick(clock.now_ns()))
        frame = frames.take() if frames else None
        if frame is not None:
            runner.handle(frame)
        for message in asked():
            runner.publish(message)
        shown(runner.state)


def _receive(bus: Bus, wait_s: float) -> Iterator[Received]:
    """What has come, after waiting for the first; at most BATCH, so that frames get their turn."""
    event = bus.receive(wait_s)
    for _ in range(BATCH):
        if event is None:
            return
        yield event
        event = bus.receive(0.0)
    if event is not None:
        yield event
