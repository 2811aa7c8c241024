"""The services of a rig on a network inside this process: the very same steps as live, in a fixed order.

Frame k of every viewer, then all that follows from it, until nobody has more to say; so that two runs give equal bytes.
"""

from collections.abc import Mapping
from typing import Generic, Protocol, TypeVar

from common.bus.local import LocalNetwork
from common.bus.protocol import FrameLike, RoundTrip, Tick
from common.runtime.rig import Rig
from common.runtime.service import Runner, Service
from common.topics import CAMERA
from services.integrator.shell import integrator_service
from services.recognizer.shell import model_of, recognizer_service
from services.tracker.shell import tracker_service
from services.viewer.shell import camera_info, silhouette_service, viewer_service
from services.viewer.sources.frame import Frame

Setup = TypeVar("Setup")
State = TypeVar("State")
F = TypeVar("F", bound=FrameLike)

FAILURES = {"steps failed": "step_errors", "messages could not be sent": "unsendable", "instants failed": "failed"}


class Member(Protocol):
    """One service that takes part.  title: for people.  drain: handle all that has come; whether there was anything."""

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
        """Nothing is ever dropped: what a step puts off is started at once."""
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
        """What the loop and the step have counted."""
        return self.runner.meter.counts | dict(self.runner.service.count(self.runner.state))


class Camera(Member, Protocol):
    """A viewer."""

    def see(self, frame: Frame) -> None: ...


class Seeing(Running[Setup, State, Frame]):
    """A `Camera` of either kind."""

    def see(self, frame: Frame) -> None:
        self.runner.handle(frame)


class Offline:
    """The viewers, what makes poses of what they say (integrator or tracker), and the recogniser if the rig has one."""

    def __init__(self, rig: Rig, network: LocalNetwork) -> None:
        """Raises as `viewer_service`, `integrator_service`, `tracker_service` and `model_of` do."""
        self._rig, self._network = rig, network
        self._viewers: dict[str, Camera] = {}
        self._poser: Member
        for viewer in rig.viewers:
            if rig.tracker is None:
                self._viewers[viewer.id] = Seeing(viewer_service(viewer), network)
            else:
                self._viewers[viewer.id] = Seeing(silhouette_service(viewer), network)
        if rig.tracker is None:
            self._poser = Running(integrator_service(rig), network)
        else:
            self._poser = Running(tracker_service(rig), network)
        self._others: list[Member] = []
        if rig.recognizer is not None:
            self._others.append(Running(recognizer_service(rig, model_of(rig)), network))

    def greet(self, epoch_ns: int) -> None:
        """Every viewer says which camera it has.  epoch_ns: capture time of frame 0."""
        bus = self._network.bus()
        for viewer in self._rig.viewers:
            bus.publish(CAMERA, camera_info(viewer, epoch_ns))
        bus.close()

    def see(self, frames: Mapping[str, Frame]) -> None:
        """The frames of one instant, in the rig's order, and all that follows from them."""
        for id, viewer in self._viewers.items():
            if id in frames:
                viewer.see(frames[id])
        while any([member.drain() for member in self._answering()]):
            pass

    def report_handled(self) -> None:
        """Let every service say what it was fed."""
        for member in (*self._viewers.values(), self._poser, *self._others):
            member.report_handled()

    def state(self) -> str:
        """What the service that makes the poses is doing, in words."""
        return self._poser.describe()

    def states(self) -> dict[str, str]:
        """What each service is doing, in words."""
        return {member.title: member.describe() for member in (*self._viewers.values(), self._poser, *self._others)}

    def failures(self) -> dict[str, int]:
        """Steps that raised, messages that may not be sent, and instants that failed, in words."""
        counts = [member.counts() for member in self._answering()]
        return {words: sum(count.get(name, 0) for count in counts) for words, name in FAILURES.items()}

    def _answering(self) -> list[Member]:
        return [self._poser, *self._viewers.values(), *self._others]
