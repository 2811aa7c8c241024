"""The services of a rig on a network inside this process: the same steps as live, in a fixed order.

Frames of every viewer, then all resulting messages until none is left; equal calls give equal bytes.
"""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope, FrameLike, RoundTrip, Tick
from zenocap.common.messages import Message
from zenocap.common.rig.services import ServiceKey, title
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Event, Runner, Service
from zenocap.common.topics import FRAME_RATE, Topic, topic_of

Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)

FAILURES = {"steps failed": "step_errors", "messages could not be sent": "unsendable", "frame sets failed": "failed"}


class SessionMember(Generic[Setup, State, F]):
    """One service of a session.  runner: handles its events."""

    def __init__(self, service: Service[Setup, State, F], network: LocalNetwork) -> None:
        self._service = service
        self._ahead: deque[tuple[F, tuple[State, Sequence[Message]] | Exception]] = deque()  # of frames still to feed
        self.runner = Runner(replace(service, step=self._step), network.bus(), network.clock)
        self.runner.subscribe()

    def ahead(self, frames: Iterator[F]) -> Iterator[F]:
        """The frames, each to be fed once and in order; stepped when they are asked for, in any thread.

        Unchanged where the step needs more than frames: there is no frame rate to follow, but poses or answers may come.
        """
        alone = all(one.topic is FRAME_RATE for one in self._service.subscriptions)
        return self._stepped_ahead(frames) if alone else frames

    def drain(self) -> bool:
        """Handle all messages, and at once what the service postpones; whether there were any."""
        any_event = False
        while (event := self.runner.bus.receive(0.0)) is not None:
            any_event = True
            if not isinstance(event, RoundTrip):
                self.runner.handle(event)
            while self.runner.pending:
                self.runner.handle(Tick(self.runner.clock.now_ns()))
        return any_event

    def describe(self) -> str:
        """State in words."""
        return self._service.describe(self.runner.state)

    def counts(self) -> Mapping[str, int]:
        """Counters of the loop and of the step."""
        return self.runner.meter.counts | dict(self._service.count(self.runner.state))

    def _stepped_ahead(self, frames: Iterator[F]) -> Iterator[F]:
        state = self._service.initial()
        for frame in frames:
            try:
                state, messages = self._service.step(self._service.setup, state, frame)
                self._ahead.append((frame, (state, messages)))
            except Exception as error:  # raised again for the runner, which counts and logs it
                self._ahead.append((frame, error))
            yield frame

    def _step(self, setup: Setup, state: State, event: Event[F]) -> tuple[State, Sequence[Message]]:
        """The step of the service, or its result for a frame from `ahead`."""
        if not self._ahead or self._ahead[0][0] is not event:
            return self._service.step(setup, state, event)
        _, result = self._ahead.popleft()
        if isinstance(result, Exception):
            raise result
        return result


class Session(Generic[F]):
    """Services of one rig, stepped until no message is left."""

    def __init__(
        self, rig: str, clock: ManualClock, services: Sequence[Service[object, object, F]], recorded: Sequence[Topic]
    ) -> None:
        """rig: its name.  services: in the order in which they handle waiting messages.  recorded: topics to return."""
        self._network, self._clock = LocalNetwork(rig, clock), clock
        self._members = {(one.name, one.id): SessionMember(one, self._network) for one in services}
        self._viewers_first = sorted(self._members, key=lambda key: key[0] != "viewer")  # stable
        self._recorder, self._bus = self._network.bus(), self._network.bus()
        for topic in recorded:
            self._recorder.subscribe(topic, every=True)

    def ahead(self, viewer: str, frames: Iterator[F]) -> Iterator[F]:
        """See `SessionMember.ahead`.  viewer: id."""
        return self._members["viewer", viewer].ahead(frames)

    def publish(self, message: Message) -> None:
        """Publish a message of no service of the session, such as a camera."""
        self._bus.publish(topic_of(type(message)), message)

    def frames(self, frames: Mapping[str, F]) -> Sequence[Envelope]:
        """Handle one frame set, by viewer, and all that follows; the recorded messages since the last call of this object.

        The time is that of the latest frame.
        """
        self._clock.set(max(frame.captured_ns for frame in frames.values()))
        for (name, id), member in self._members.items():
            if name == "viewer" and id in frames:
                member.runner.handle(frames[id])
        return self._settled()

    def replay(self, recorded: Envelope) -> Sequence[Envelope]:
        """Handle one recorded message, at its time or the present one if that is later, and all that follows."""
        self._clock.set(max(self._clock.now_ns(), recorded.received_ns))
        self._bus.forward(recorded.topic, recorded.key, recorded.data)
        return self._settled()

    def report(self, service: ServiceKey | None = None) -> Sequence[Envelope]:
        """Input traces since the last report, of one service, or of all: the viewers first."""
        for key in self._viewers_first:
            if service in (None, key):
                self._members[key].runner.report_handled()
        return self._taken()

    def describe(self, service: ServiceKey) -> str:
        """State of a service in words."""
        return self._members[service].describe()

    def states(self) -> dict[str, str]:
        """State of each service in words, by its title, the viewers first."""
        return {title(key): self._members[key].describe() for key in self._viewers_first}

    def failures(self) -> dict[str, int]:
        """Number of failures by kind: steps that raised, messages that could not be published, failed frame sets."""
        counts = [member.counts() for member in self._members.values()]
        return {text: sum(count.get(name, 0) for count in counts) for text, name in FAILURES.items()}

    def _settled(self) -> Sequence[Envelope]:
        while any([member.drain() for member in self._members.values()]):  # a list: each round drains every member
            pass
        return self._taken()

    def _taken(self) -> Sequence[Envelope]:
        found = []
        while (event := self._recorder.receive(0.0)) is not None:
            if isinstance(event, Envelope):
                found.append(event)
        return found
