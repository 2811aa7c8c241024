"""The services of a rig on a network inside this process: the same steps as live, in a fixed order.

Frame k of every viewer, then all resulting messages until none is left; two runs give equal bytes.
"""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, RoundTrip, Tick
from zenocap.common.messages import Message
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.service import Runner, Service
from zenocap.common.topics import CAMERA, FRAME_RATE
from zenocap.services.recognizer.shell import model_of, recognizer_service
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.shell import camera_info, people_of, service_of

Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)

FAILURES = {"steps failed": "step_errors", "messages could not be sent": "unsendable", "frame sets failed": "failed"}


class Member(Protocol):
    """A service.  title: for display.  drain: handle all received messages; returns whether there were any."""

    @property
    def title(self) -> str: ...

    def drain(self) -> bool: ...

    def report_handled(self) -> None: ...

    def describe(self) -> str: ...

    def counts(self) -> Mapping[str, int]: ...


class Running(Generic[Setup, State, F]):
    """A `Member` of any kind of service."""

    def __init__(self, service: Service[Setup, State, F], network: LocalNetwork) -> None:
        self.runner = Runner(service, network.bus(), network.clock)
        self.runner.subscribe()

    @property
    def title(self) -> str:
        service = self.runner.service
        return f"{service.name} {service.id}" if service.name == "viewer" else service.name

    def drain(self) -> bool:
        """Handle all messages; nothing is dropped, and postponed work is run at once."""
        any_event = False
        while (event := self.runner.bus.receive(0.0)) is not None:
            any_event = True
            if not isinstance(event, RoundTrip):
                self.runner.handle(event)
            while self.runner.pending:
                self.runner.handle(Tick(self.runner.clock.now_ns()))
        return any_event

    def report_handled(self) -> None:
        self.runner.report_handled()

    def describe(self) -> str:
        return self.runner.service.describe(self.runner.state)

    def counts(self) -> Mapping[str, int]:
        """Counters of the loop and of the step."""
        return self.runner.meter.counts | dict(self.runner.service.count(self.runner.state))


class ViewerMember(Member, Protocol):
    """A viewer.  read: its frames, with what can be computed before they are processed, in any thread."""

    def read(self, frames: Iterator[Frame]) -> Iterator[Frame]: ...

    def process(self, frame: Frame) -> None: ...


class AnsweredViewer(Running[Setup, State, Frame]):
    """A `ViewerMember` whose steps depend on the answers of the integrator, or on the poses of the tracker."""

    def read(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        return frames

    def process(self, frame: Frame) -> None:
        self.runner.handle(frame)


class SilhouetteViewer(Running[Setup, State, Frame]):
    """A `ViewerMember` whose steps depend on its frames alone: those of frames from `read` are computed there."""

    def __init__(self, service: Service[Setup, State, Frame], network: LocalNetwork) -> None:
        super().__init__(replace(service, step=self._stepped), network)
        self._service = service
        self._results: deque[tuple[Frame, tuple[State, Sequence[Message]] | Exception]] = (
            deque()
        )  # of frames still to process

    def read(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        state = self._service.initial()
        for frame in frames:
            try:
                state, messages = self._service.step(self._service.setup, state, frame)
                self._results.append((frame, (state, messages)))
            except Exception as error:  # raised again for the runner, which counts and logs it
                self._results.append((frame, error))
            yield frame

    def process(self, frame: Frame) -> None:
        self.runner.handle(frame)

    def _stepped(
        self, setup: Setup, state: State, event: Frame | Envelope | Alive | Tick
    ) -> tuple[State, Sequence[Message]]:
        """The step of the service, or its result for a frame from `read`."""
        if not self._results or self._results[0][0] is not event:
            return self._service.step(setup, state, event)
        _, result = self._results.popleft()
        if isinstance(result, Exception):
            raise result
        return result


class Offline:
    """The viewers, the integrator or tracker, and the recognizer if the rig has one."""

    def __init__(self, rig: Rig, network: LocalNetwork) -> None:
        """Raises as the services of the rig's method, `people_of` and `model_of` do."""
        self._rig, self._network = rig, network
        self._viewers: dict[str, ViewerMember] = {}
        self._pose_service: Member
        for viewer in rig.viewers:
            service = service_of(rig, viewer, people_of(viewer, threaded=False))
            # Frames are all that a viewer needs where nobody answers it: offline there is no frame rate to follow.
            alone = all(one.topic is FRAME_RATE for one in service.subscriptions)
            self._viewers[viewer.id] = (SilhouetteViewer if alone else AnsweredViewer)(service, network)
        self._pose_service = Running(method_of(rig.method).new_pose_service(rig), network)
        self._others: list[Member] = []
        if rig.recognizer is not None:
            self._others.append(Running(recognizer_service(rig, model_of(rig)), network))

    def publish_cameras(self, epoch_ns: int) -> None:
        """Publish the camera of every viewer.  epoch_ns: capture time of frame 0."""
        bus = self._network.bus()
        for viewer in self._rig.viewers:
            bus.publish(CAMERA, camera_info(viewer, epoch_ns))
        bus.close()

    def read(self, id: str, frames: Iterator[Frame]) -> Iterator[Frame]:
        """The frames of a viewer, all to be processed in this order; may be advanced in any thread."""
        return self._viewers[id].read(frames)

    def process(self, frames: Mapping[str, Frame]) -> None:
        """Handle the frames of one frame set, in the rig's order, and all resulting messages."""
        for id, viewer in self._viewers.items():
            if id in frames:
                viewer.process(frames[id])
        while any([member.drain() for member in self._members()]):
            pass

    def report_handled(self) -> None:
        """Let every service publish its input trace."""
        for member in (*self._viewers.values(), self._pose_service, *self._others):
            member.report_handled()

    def state(self) -> str:
        """State of the integrator or tracker in words."""
        return self._pose_service.describe()

    def states(self) -> dict[str, str]:
        """State of each service in words."""
        return {member.title: member.describe() for member in (*self._viewers.values(), self._pose_service, *self._others)}

    def failures(self) -> dict[str, int]:
        """Number of failures by kind: steps that raised, messages that could not be published, failed frame sets."""
        counts = [member.counts() for member in self._members()]
        return {text: sum(count.get(name, 0) for count in counts) for text, name in FAILURES.items()}

    def _members(self) -> list[Member]:
        return [self._pose_service, *self._viewers.values(), *self._others]
