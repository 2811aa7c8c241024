"""The services of a take's rig, ready to be fed again what they were fed."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from common.bus.protocol import Alive, Envelope, Tick
from common.messages import Message
from common.runtime.specs import FirstFrames
from common.take.setup import POSTURES_FILE, PRIOR_FILE, RecordedRig, RecordedViewer
from services.integrator import states
from services.integrator import step as integrator
from services.integrator.shell import ID, setup_of
from services.recognizer import shell as recognizer_shell
from services.recognizer import states as recognizer_states
from services.recognizer import step as recognizer
from services.tracker import shell as tracker_shell
from services.tracker import states as tracker_states
from services.tracker import step as tracker
from services.tracker import tracking
from services.viewer import step as viewer
from services.viewer.frame import Masked
from services.viewer.states import LearningBackground

Event = Masked | Envelope | Alive | Tick
Name = tuple[str, str]  # service and id
Setup = TypeVar("Setup")
State = TypeVar("State")


class Repeatable(Protocol):
    """A service whose step can be run again.  begin: as when it started."""

    def begin(self) -> None: ...

    def step(self, event: Event) -> Sequence[Message]: ...

    @property
    def learning(self) -> bool:
        """Whether frames need no silhouette yet."""


class Repeated(Generic[Setup, State]):
    """A service's pure step and its state."""

    def __init__(
        self, setup: Setup, initial: State, step: Callable[[Setup, State, Event], tuple[State, Sequence[Message]]]
    ) -> None:
        self._setup, self._initial, self._step = setup, initial, step
        self._state = initial

    def begin(self) -> None:
        self._state = self._initial

    def step(self, event: Event) -> Sequence[Message]:
        """The messages that followed.  Raises whatever the step does, and then has the state before it, as live."""
        self._state, messages = self._step(self._setup, self._state, event)
        return messages

    @property
    def learning(self) -> bool:
        return isinstance(self._state, LearningBackground)


def services_of(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[Name, Repeatable]:
    """Those that derive something, by name.  path: of the take, for errors.  attached: what lies beside its messages.

    Raises ValueError for cameras that the method cannot use, or another prior or model than the take was made with.
    """
    found = _recognizer(rig, path, attached)
    if rig.tracker is not None:
        follower = tracker_shell.setup_of(rig, tracker_shell.prior_in(rig, path, attached.get(PRIOR_FILE)))
        return found | {("tracker", tracker_shell.ID): Repeated(follower, tracker.initial_state(follower), _tracker_step)}
    setup = setup_of(rig)
    found |= {("integrator", ID): Repeated(setup, integrator.initial_state(setup), _integrator_step)}
    return found | {("viewer", one.id): _viewer(one) for one in rig.viewers}


def _recognizer(rig: RecordedRig, path: Path, attached: Mapping[str, bytes]) -> dict[Name, Repeatable]:
    """None where the rig says of none, or its model was not at hand where the take was written."""
    model = recognizer_shell.model_in(rig, path, attached.get(POSTURES_FILE))
    if model is None:
        return {}
    setup = recognizer_shell.setup_of(rig, model)
    return {("recognizer", recognizer_shell.ID): Repeated(setup, recognizer.initial_state(setup), _recognizer_step)}


def _viewer(recorded: RecordedViewer) -> Repeatable:
    # The background was learnt from so many frames; which they were does not matter once silhouettes are in the take.
    background = FirstFrames(recorded.learning_frames)
    setup = viewer.viewer_setup(recorded.id, recorded.pinhole(), background, publish_silhouette=False)
    return Repeated(setup, viewer.initial_state(setup), viewer.step)


def _integrator_step(setup: states.Setup, state: states.State, event: Event) -> tuple[states.State, Sequence[Message]]:
    return integrator.step(setup, state, event)


def _tracker_step(
    setup: tracking.Setup, state: tracker_states.State, event: Event
) -> tuple[tracker_states.State, Sequence[Message]]:
    return tracker.step(setup, state, event)


def _recognizer_step(
    setup: recognizer_states.Setup, state: recognizer_states.State, event: Event
) -> tuple[recognizer_states.State, Sequence[Message]]:
    return recognizer.step(setup, state, event)
