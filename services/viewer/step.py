"""Step of a viewer beside a tracker: a frame in, its silhouette out.

The body and the limbs are not searched.  With feedback the tracker's body and poses are inputs too: the expected image of
the body is drawn when a pose arrives, not when a frame does.
"""

from dataclasses import dataclass, replace

from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.messages import Message, Phase
from zenocap.services.viewer.feedback import NO_FEEDBACK, Feedback, receive
from zenocap.services.viewer.frame import Frame, SegmentedFrame, silhouette_message
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, Segmentation, ViewerSetup

Event = Frame | SegmentedFrame | Envelope | Alive | Tick


@dataclass(frozen=True)
class LearningWithFeedback(LearningBackground):
    """feedback: of the tracker, where the rig has one."""

    feedback: Feedback = NO_FEEDBACK


@dataclass(frozen=True)
class Segmenting:
    """State after the background is learnt.  present: a person was in the last frame.  feedback: of the tracker."""

    scene: Segmentation
    present: bool = False
    feedback: Feedback = NO_FEEDBACK


SilhouetteState = LearningWithFeedback | Segmenting


def initial_state(setup: ViewerSetup) -> SilhouetteState:
    return LearningWithFeedback()


def step(setup: ViewerSetup, state: SilhouetteState, event: Event) -> tuple[SilhouetteState, list[Message]]:
    """Process one event: (state, messages).  Pure."""
    match state, event:
        case LearningWithFeedback(), Frame(image=image):
            state, scene = learn(setup, state, image)
            return (state if scene is None else Segmenting(scene, feedback=state.feedback)), []
        case Segmenting(scene=scene, feedback=feedback), Frame():
            scene, mask, messages = segment(setup, scene, event, feedback.usable)
            feedback = replace(feedback, frames=feedback.frames + 1)
            message = silhouette_message(setup.id, setup.camera.size, event, mask)
            return Segmenting(scene, mask is not None, feedback), [*messages, message]
        case LearningWithFeedback() | Segmenting(), Envelope(message=message):
            return replace(state, feedback=receive(setup.camera, state.feedback, message)), []
        case _:
            return state, []


def phase_of(state: SilhouetteState) -> Phase:
    """Phase of the viewer, for its health."""
    match state:
        case LearningWithFeedback():
            return Phase.LEARNING_BACKGROUND
        case Segmenting(present=present):
            return Phase.SEGMENTING if present else Phase.AWAITING_PERSON


def describe(state: SilhouetteState) -> str:
    """Health text of a state."""
    match state:
        case LearningWithFeedback(frames=frames):
            return f"learning the background ({len(frames)} frames)"
        case Segmenting(present=present):
            return "silhouettes only" + ("" if present else ", no person in view")
