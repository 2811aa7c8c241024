"""The service loop: events in, pure step, messages out.

A service is its `step(setup, state, event) -> (state, messages)`.  The loop passes it frames, envelopes, alive changes and
ticks from one thread, publishes the messages it returns, and publishes its health at 1 Hz and at the end.
"""

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from typing import Generic, Never, TypeAlias, TypeVar, cast

from zenocap.common.bus.protocol import Alive, Bus, BusError, Envelope, FrameLike, Received, RoundTrip, Tick
from zenocap.common.messages import ENDED, FrameRate, Message, Phase
from zenocap.common.rig.methods import Method
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.clock_offset import ClockFilter, Offset, observe, offset_at
from zenocap.common.runtime.frame_rate import CAPTURED, DROPPED, SKIPPED, FrameChoice
from zenocap.common.runtime.health import Meter
from zenocap.common.runtime.input_trace import Trace, event_text, kind_of
from zenocap.common.runtime.latest_frame import NewestFrame
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.runtime.queries import PeriodicQueries
from zenocap.common.runtime.signals import GivenUp, come_round, until_stopped
from zenocap.common.table import attribute
from zenocap.common.topics import Topic, topic_of

logger = logging.getLogger(__name__)

HEALTH_NS = 1_000_000_000
BATCH = 256  # messages handled before a waiting frame, chosen by hand
WAIT_S = 0.1  # longest wait for an event, so that signals are handled


Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)
Event: TypeAlias = F | Envelope | Alive | Tick
Step: TypeAlias = Callable[[Setup, State, Event[F]], tuple[State, Sequence[Message]]]


@dataclass(frozen=True)
class TopicSubscription:
    """names: of the publishers; default: all.  every: receive each message in order, also of a LATEST topic."""

    topic: Topic
    every: bool = False
    names: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Service(Generic[Setup, State, F]):
    """initial: makes the first state, a new one each time.

    name, id: as in its health and liveliness.  phase: of the state, for programs; describe: text for display.  count:
    counters of the state.

    tick_ns: period of Ticks, 0 for never.  keeps_time: this is the integrator, whose clock the others use.
    pending: whether the state has work to be started by a Tick after all received events are handled.
    result: messages whose age since their capture is a stage of the health.
    recovers: its own topics whose last message from before a restart the state lacks: queried, and passed to the step.
    answers: number of the frame of this service that a message of another one answers, None for other messages.
    derives: whether it publishes its input trace, so that its messages can be recomputed; False for display services.
    load: loads what is compiled, before the first event of a process; may take a minute.
    max_failures: consecutive failures of the step, except on messages of other services, before the service ends.
    """

    name: str
    id: str
    setup: Setup
    initial: Callable[[], State]
    step: Step[Setup, State, F]
    subscriptions: tuple[TopicSubscription, ...] = ()
    describe: Callable[[State], str] = lambda state: type(state).__name__
    count: Callable[[State], Mapping[str, int]] = lambda state: {}
    phase: Callable[[State], Phase] = lambda state: Phase.RUNNING
    watch_alive: bool = False
    tick_ns: int = 0
    pending: Callable[[State], bool] = lambda state: False
    recovers: Callable[[State], Collection[Topic]] = lambda state: ()
    answers: Callable[[Message], int | None] = lambda message: None
    result: type[Message] | None = None
    keeps_time: bool = False
    derives: bool = True
    load: Callable[[], object] = lambda: None
    max_failures: int = 10


class TooManyFailures(Exception):
    """The step failed `max_failures` times in a row."""


def interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is among the causes of an error: numba makes a SystemError of one in the first call of a kernel."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def new_pose_service(method: Method, rig: object) -> Service[object, object, Never]:
    """The service that publishes the poses of a `Rig` of a method.  Raises as the method's factory does."""
    return cast("Callable[[object], Service[object, object, Never]]", attribute(method.pose))(rig)


class Stepper(Generic[Setup, State, F]):
    """A service's pure step and its state: no bus, no clock."""

    def __init__(self, service: Service[Setup, State, F]) -> None:
        self._service = service
        self.state = service.initial()

    def restart(self) -> None:
        """Return to the initial state."""
        self.state = self._service.initial()

    def step(self, event: Event[F]) -> Sequence[Message]:
        """Messages published for an input.  Raises as the step does, and then keeps the state before it.

        Raises KeyboardInterrupt for an error that it has become, so that no user counts Ctrl-C as a failed step.
        """
        try:
            self.state, messages = self._service.step(self._service.setup, self.state, event)
        except Exception as error:
            if interrupted(error):
                raise KeyboardInterrupt from error
            raise
        return messages


class Runner(Generic[Setup, State, F]):
    """One service on one bus: its state and the handling of one event.  Used by `run`, and directly offline."""

    def __init__(self, service: Service[Setup, State, F], bus: Bus, clock: Clock) -> None:
        self.service = service
        self.bus = bus
        self.clock = clock
        self._stepper = Stepper(service)
        self.meter = Meter(service.name, service.id)
        self._trace = Trace(service.name, service.id)
        self._failures = 0
        self._frame = -1
        self._log_once = OncePerSource(logger)

    @property
    def state(self) -> State:
        return self._stepper.state

    def subscribe(self) -> None:
        for subscription in self.service.subscriptions:
            self.bus.subscribe(subscription.topic, every=subscription.every, **subscription.names)
        if self.service.watch_alive:
            self.bus.watch_alive()

    def handle(self, event: Event[F], stopped: Callable[[], bool] | None = None) -> None:
        """Run one step and publish its messages.

        stopped: ends the step, as if it had come before the event, see `until_stopped`; None: the step is always done.
        Raises TooManyFailures after `max_failures` failures in a row; failures on messages of other services do not count.
        """
        kind, source = kind_of(event), event_text(event)
        if self.service.derives:
            if self._trace.full:
                self.report_handled()
            self._trace.add(event)
        of_source = not isinstance(event, Envelope | Alive | Tick)
        learning = of_source and self.service.phase(self.state) is Phase.LEARNING_BACKGROUND
        started_ns = self.clock.elapsed_ns()
        try:
            with until_stopped(stopped) if stopped is not None else nullcontext():
                messages = self._stepper.step(event)
        except GivenUp:
            if self.service.derives:
                self._trace.take_back()
            return
        except Exception as error:  # one bad frame must not end a take; the previous state is kept
            self._failures += not isinstance(event, Envelope)
            self.meter.counts["step_errors"] += 1
            if of_source:
                self.meter.counts["failed_frames"] += 1
            self._log_once.warn(kind, "step", f"step failed on {source}: {type(error).__name__}: {error}", trace=True)
            if self._failures >= self.service.max_failures:
                why = str(error) or type(error).__name__  # that of a MemoryError is empty
                raise TooManyFailures(f"{self._failures} steps in a row failed, the last on {source}: {why}") from error
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
        self._count(event, learning=learning)

    def _count(self, event: Event[F], *, learning: bool) -> None:
        """Count a handled event.  learning: a frame from which the background is learnt."""
        if isinstance(event, Envelope):
            answered = self.service.answers(event.message)
            if answered is not None and answered < self._frame:  # a newer frame has replaced it
                self.meter.counts["late_answers"] += 1
        elif not isinstance(event, Alive | Tick):
            self._frame = event.frame
            self.meter.frame()
            if learning:
                self.meter.counts["learning_frames"] += 1
            self.meter.time("frame_age", self.clock.now_ns() - event.captured_ns)

    def set_counts(self, counts: Mapping[str, int]) -> None:
        """Counts of others for the health."""
        for name, count in counts.items():
            self.meter.counts[name] = count  # `Counter.update` would add

    def report(self, text: str, offset: Offset | None) -> None:
        """Publish the health.  text: of the state, for display."""
        clock, phase = self.clock, self.service.phase(self.state)
        self.publish(self.meter.report(clock.now_ns(), clock.elapsed_ns(), phase, text, self.bus.counters, offset))

    @property
    def pending(self) -> bool:
        """Whether the state has work for a Tick after all received events are handled."""
        return self.service.pending(self.state)

    def report_handled(self) -> None:
        """Publish the input trace since the last report."""
        handled = self._trace.report(self.clock.now_ns())
        if handled is not None:
            self.publish(handled)

    def publish(self, message: Message) -> Topic | None:
        """Publish a message; returns its topic, or None when it is invalid, which is counted and logged."""
        try:
            topic = topic_of(type(message))
            self.bus.publish(topic, message)
            return topic
        except ValueError as error:  # includes BadMessage
            self.meter.counts["unsendable"] += 1
            self._log_once.warn(type(message).__name__, "unsendable", str(error))
            return None


class FirstMessages:
    """Messages of a process that hold until its end: published at its start, and again where another program replaces one.

    Readers keep the last one of a key.  The own one is published at once, but once between two healths, and with the next
    health: a reader may receive both in the other order.
    """

    def __init__(self, bus: Bus, publish: Callable[[Message], object], messages: Sequence[Message]) -> None:
        self._publish = publish
        self._own = dict[str, Message]()
        self._replaced = set[str]()  # keys, since the last health
        for message in messages:
            topic = topic_of(type(message))
            names = topic.names_of(message)
            self._own[topic.at(bus.rig, **names)] = message
            publish(message)
            bus.subscribe(topic, every=False, **names)

    def others(self, events: Iterable[Received]) -> Iterator[Received]:
        """The events without the messages on these keys."""
        for event in events:
            if not isinstance(event, Envelope) or event.key not in self._own:
                yield event
            elif event.message != self._own[event.key] and event.key not in self._replaced:
                self._replaced.add(event.key)
                self._publish(self._own[event.key])

    def repeat(self) -> None:
        """Publish those that were replaced since the last call."""
        for key in sorted(self._replaced):
            self._publish(self._own[key])
        self._replaced.clear()


def run(
    service: Service[Setup, State, F], bus: Bus, clock: Clock, source: Iterator[F] | None = None,
    stopped: Callable[[], bool] = lambda: False, *, extra_counts: Callable[[], Mapping[str, int]] = dict,
    first_messages: Sequence[Message] = (), requested: Callable[[], Sequence[Message]] = tuple,
    on_state: Callable[[State], None] = lambda _: None, on_clock_offset: Callable[[Offset | None], None] = lambda _: None,
    choice: FrameChoice | None = None, final_counts: Callable[[], Mapping[str, int]] | None = None,
) -> int:  # fmt: skip
    """Run until `stopped` or the end of `source`; exit status 0, or 1 after a failure, which is logged.

    extra_counts: further counts for this service's health, such as those of its log.
    first_messages: see `FirstMessages`; after the check that no other process runs this service.
    requested: returns messages of other threads to publish; they call `bus.wake()` to have them published immediately.
    on_state: receives the state whenever all received events are handled.
    on_clock_offset: receives the offset of this clock to the integrator's, None while unknown, once a second.
    choice: frames of the source that are processed; it follows the decisions on the frame rate that are received.
    final_counts: ends what the service owns, such as its log, and returns counts for one more health; None for none.
    """
    runner = Runner(service, bus, clock)
    frames = NewestFrame(source, bus.wake) if source is not None else None
    try:
        bus.declare_alive(service.name, service.id)
        if service.keeps_time:
            bus.serve_clock()
        runner.subscribe()
        first = FirstMessages(bus, runner.publish, first_messages)
        if frames:
            frames.start()
        _loop(runner, frames, first, stopped, extra_counts, requested, on_state, on_clock_offset, choice)
        if final_counts is not None:
            runner.set_counts(final_counts())
            runner.report(service.describe(runner.state), None)
    except (BusError, TooManyFailures) as error:
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
    runner: Runner[Setup, State, F], frames: NewestFrame[F] | None, first: FirstMessages, stopped: Callable[[], bool],
    extra_counts: Callable[[], Mapping[str, int]], requested: Callable[[], Sequence[Message]],
    on_state: Callable[[State], None], on_clock_offset: Callable[[Offset | None], None], choice: FrameChoice | None,
) -> None:  # fmt: skip
    service, bus, clock = runner.service, runner.bus, runner.clock
    trips = ClockFilter()
    health_ns = tick_ns = clock.elapsed_ns()
    queries = PeriodicQueries(bus, health_ns, keeps_time=service.keeps_time)

    def report() -> None:
        offset = offset_at(trips, clock.now_ns())
        on_clock_offset(offset)
        first.repeat()
        come_round()
        runner.set_counts(extra_counts())
        runner.set_counts(service.count(runner.state))
        _report(runner, frames, choice, offset)

    while not stopped() and not (frames and frames.ended):
        now_ns = clock.elapsed_ns()
        queries.ask(now_ns, service.recovers(runner.state))
        if now_ns >= health_ns:
            report()
            runner.report_handled()
            health_ns = max(health_ns + HEALTH_NS, now_ns)
        if service.tick_ns and now_ns >= tick_ns:
            runner.handle(Tick(clock.now_ns()))
            tick_ns = max(tick_ns + service.tick_ns, now_ns)
        wait_s = 0.0 if runner.pending else min(WAIT_S, service.tick_ns / 1e9 or WAIT_S)
        for event in first.others(received(bus, wait_s)):
            if isinstance(event, RoundTrip):
                trips = observe(trips, event)
            elif choice and isinstance(event, Envelope) and isinstance(event.message, FrameRate):
                choice.set_rate(event.message)  # no input of the step: the frames that it lets through are
            else:
                runner.handle(event)
        if runner.pending:  # the tracker measures a body in half a second, beside other programs in six
            runner.handle(Tick(clock.now_ns()), stopped)
        frame = frames.take() if frames else None
        if frame is not None:
            if frames and choice:
                choice.begin_frame(frames.dropped + choice.late + runner.meter.counts["late_answers"])
            runner.handle(frame)
        for message in requested():
            runner.publish(message)
        on_state(runner.state)
    runner.report_handled()
    runner.meter.counts[ENDED] = 1
    report()  # the last one: it has the numbers of all messages before
    come_round(loops=False)


def _report(
    runner: Runner[Setup, State, F], frames: NewestFrame[F] | None, choice: FrameChoice | None, offset: Offset | None
) -> None:
    """Publish the health, with what became of the frames.  offset: of this clock to the integrator's."""
    text = runner.service.describe(runner.state)
    if choice:
        choice.set_clock_offset(offset)
        runner.set_counts(choice.counts())
        if reduced := choice.describe():
            text = f"{text}; {reduced}"
    if frames:
        (given, dropped), late = frames.counts(), choice.late if choice else 0
        skipped = runner.meter.counts[SKIPPED]  # as in this health: the source goes on
        runner.set_counts({DROPPED: dropped + late, CAPTURED: given + late + skipped})
    runner.report(text, offset)


def received(bus: Bus, wait_s: float) -> Iterator[Received]:
    """The queued events, after waiting for the first; at most BATCH: frames, commands and the end wait for no flood."""
    event = bus.receive(wait_s)
    for _ in range(BATCH):
        if event is None:
            return
        yield event
        event = bus.receive(0.0)
    if event is not None:
        yield event
