"""Step of a viewer beside a tracker: a frame in, its silhouette out.

The body and the limbs are not searched.  With feedback the tracker's body and poses are inputs too: the expected image of
the body is drawn when a pose arrives, not when a frame does.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Message, Phase, TrackerPose
from zenocap.common.observe.bodies import NO_BODIES, Bodies, Posed, posed, source_of
from zenocap.common.vision.prediction import Prediction, predicted
from zenocap.services.viewer.frame import Frame, SegmentedFrame, silhouette_message
from zenocap.services.viewer.parameters import FEEDBACK_FRAMES, FEEDBACK_GAP_NS
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, Segmentation, ViewerSetup

Event = Frame | SegmentedFrame | Envelope | Alive | Tick


@dataclass(frozen=True)
class Feedback:
    """Pose and body of the tracked person.

    bodies: of the tracker.  points: (parts, points, 3) of the last pose in the world, metres, None after a track
    loss; captured_ns: of that pose.  prediction: for the next frame.  frames: of this viewer since that pose.
    """

    bodies: Bodies = field(default_factory=lambda: NO_BODIES)
    points: Floats | None = None
    captured_ns: int = 0
    prediction: Prediction | None = None
    frames: int = 0

    @property
    def usable(self) -> Prediction | None:
        """The prediction while it is of one of the last frames."""
        return self.prediction if self.frames < FEEDBACK_FRAMES else None


NO_FEEDBACK = Feedback()  # before the first message


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
        case LearningWithFeedback(seen=seen):
            return f"learning the background ({seen} frames)"
        case Segmenting(present=present):
            return "silhouettes only" + ("" if present else ", no person in view")


def receive(camera: Camera, feedback: Feedback, message: Message) -> Feedback:
    """The state after a message of the tracker.  A body or pose that cannot be used leaves no prediction."""
    if source_of(message) != "tracker":
        return feedback
    try:
        bodies, found = posed(feedback.bodies, message)
    except ValueError:  # of another anatomy: the rig has been changed
        return NO_FEEDBACK
    if isinstance(message, TrackerPose) and message.lost:
        return replace(feedback, points=None, prediction=None)
    return replace(feedback, bodies=bodies) if found is None else _expecting(camera, feedback, found)


def _expecting(camera: Camera, feedback: Feedback, posed: Posed) -> Feedback:
    captured_ns = posed.message.captured_ns
    points = np.stack(body_ellipses(posed.body, part_frames(posed.anatomy, posed.body, posed.pose)))
    motion = None
    if feedback.points is not None and 0 < captured_ns - feedback.captured_ns <= FEEDBACK_GAP_NS:
        motion = points - feedback.points
    prediction = predicted(camera, points, motion)
    return replace(feedback, points=points, captured_ns=captured_ns, prediction=prediction, frames=0)
