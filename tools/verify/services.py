"""The services of a take's rig, set up to process their recorded inputs again."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.messages import Message
from zenocap.common.recording.setup_file import POSTURES_FILE, PRIOR_FILE, RecordedRig, RecordedViewer
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.services import MAIN, ServiceKey, kinds_of
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.rig.two_view import Additions
from zenocap.services.integrator import states, timekeeper
from zenocap.services.integrator import step as integrator
from zenocap.services.integrator.shell import setup_of, timekeeper_setup_of
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState
from zenocap.services.recognizer import shell as recognizer_shell
from zenocap.services.recognizer import step as recognizer
from zenocap.services.tracker import shell as tracker_shell
from zenocap.services.tracker import states as tracker_states
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker import tracking
from zenocap.services.viewer import step as viewer
from zenocap.services.viewer.frame import SegmentedFrame
from zenocap.services.viewer.states import LearningBackground

Event = SegmentedFrame | Envelope | Alive | Tick
Setup = TypeVar("Setup")
State = TypeVar("State")


class RecomputedService(Protocol):
    """A service whose step is run again.  restart: return to the initial state."""

    def restart(self) -> None: ...

    def step(self, event: Event) -> Sequence[Message]: ...

    @property
    def learning(self) -> bool:
        """Whether the background is being learnt: frames have no silhouette yet."""


class SteppedService(Generic[Setup, State]):
    """A service's pure step and its state."""

    def __init__(
        self, setup: Setup, initial: State, step: Callable[[Setup, State, Event], tuple[State, Sequence[Message]]]
    ) -> None:
        self._setup, self._initial, self._step = setup, initial, step
        self._state = initial

    def restart(self) -> None:
        self._state = self._initial

    def step(self, event: Event) -> Sequence[Message]:
        """Messages published for an input.  Raises as the step does and then keeps the state before it, as live."""
        self._state, messages = self._step(self._setup, self._state, event)
        return messages

    @property
    def learning(self) -> bool:
        return isinstance(self._state, LearningBackground)


def services_of(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[ServiceKey, RecomputedService]:
    """Services that publish derived messages, by name.  path: of the take, for errors.  attached: its attachments.

    Raises ValueError for cameras that the method cannot use, or another prior or model than the recorded one.
    """
    return {
        (kind.name, id): service
        for kind in kinds_of(rig)
        if kind.recomputed(rig)
        for id, service in BUILD[kind.name](rig, path, attached).items()
    }


def _viewers(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[str, RecomputedService]:
    return {recorded.id: _viewer(recorded, rig.added()) for recorded in rig.viewers}


def _integrator(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[str, RecomputedService]:
    if method_of(rig.method).pose_service != "integrator":  # clock, log, frame rate, delays
        return {MAIN: SteppedService(timekeeper_setup_of(rig), TimekeeperState(), _timekeeper_step)}
    setup = setup_of(rig)
    return {MAIN: SteppedService(setup, integrator.initial_state(setup), _integrator_step)}


def _tracker(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[str, RecomputedService]:
    setup = tracker_shell.setup_of(rig, tracker_shell.prior_in(rig, path, attached.get(PRIOR_FILE)))
    return {MAIN: SteppedService(setup, tracker.initial_state(setup), _tracker_step)}


def _recognizer(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[str, RecomputedService]:
    """Empty where the model of the rig was missing when the take was recorded."""
    model = recognizer_shell.model_in(rig, path, attached.get(POSTURES_FILE))
    if model is None:
        return {}
    setup = recognizer_shell.setup_of(rig, model)
    return {MAIN: SteppedService(setup, recognizer.initial_state(setup), _recognizer_step)}


def _viewer(recorded: RecordedViewer, additions: Additions) -> RecomputedService:
    # Only the number of learning frames matters: silhouettes come from the take.
    background = FirstFrames(recorded.learning_frames)
    setup = viewer.viewer_setup(recorded.id, recorded.pinhole(), background, publish_silhouette=False, additions=additions)
    return SteppedService(setup, viewer.initial_state(setup), viewer.step)


def _integrator_step(setup: states.Setup, state: states.State, event: Event) -> tuple[states.State, Sequence[Message]]:
    return integrator.step(setup, state, event)


def _timekeeper_step(
    setup: TimekeeperSetup, state: TimekeeperState, event: Event
) -> tuple[TimekeeperState, Sequence[Message]]:
    return timekeeper.step(setup, state, event)


def _tracker_step(
    setup: tracking.Setup, state: tracker_states.State, event: Event
) -> tuple[tracker_states.State, Sequence[Message]]:
    return tracker.step(setup, state, event)


def _recognizer_step(
    setup: recognizer.Setup, state: recognizer.State, event: Event
) -> tuple[recognizer.State, Sequence[Message]]:
    return recognizer.step(setup, state, event)


# By name in the table of services; ids within.
BUILD: Mapping[str, Callable[[RecordedRig, Path, Mapping[str, bytes]], dict[str, RecomputedService]]] = {
    "viewer": _viewers, "integrator": _integrator, "tracker": _tracker, "recognizer": _recognizer,
}  # fmt: skip
