"""The tracker's pose in a viewer, and the body image expected in its next frame."""

from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import anatomy_of, angles_of, bdp_of
from zenocap.common.messages import Message, TrackerBdp, TrackerPose
from zenocap.common.vision.prediction import Prediction, predicted
from zenocap.services.viewer.parameters import FEEDBACK_FRAMES, FEEDBACK_GAP_NS


@dataclass(frozen=True)
class Feedback:
    """Pose and body of the tracked person.

    body: None before one arrived.  points: (parts, points, 3) of the last pose in the world, metres, None after a track
    loss; captured_ns: of that pose.  prediction: for the next frame.  frames: of this viewer since that pose.
    """

    body: tuple[Anatomy, Bdp] | None = None
    points: Floats | None = None
    captured_ns: int = 0
    prediction: Prediction | None = None
    frames: int = 0

    @property
    def usable(self) -> Prediction | None:
        """The prediction while it is of one of the last frames."""
        return self.prediction if self.frames < FEEDBACK_FRAMES else None


NO_FEEDBACK = Feedback()  # before the first message


def receive(camera: Camera, feedback: Feedback, message: Message) -> Feedback:
    """The state after a message of the tracker.  A body or pose that cannot be used leaves no prediction."""
    try:
        match message:
            case TrackerBdp(body=body):
                anatomy = anatomy_of(body)
                return replace(feedback, body=(anatomy, bdp_of(anatomy, body)))
            case TrackerPose(lost=True):
                return replace(feedback, points=None, prediction=None)
            case TrackerPose() if feedback.body is not None:
                return _posed(camera, feedback, feedback.body, message)
    except ValueError:  # of another anatomy: the rig has been changed
        return NO_FEEDBACK
    return feedback


def _posed(camera: Camera, feedback: Feedback, body: tuple[Anatomy, Bdp], message: TrackerPose) -> Feedback:
    anatomy, bdp = body
    pose = Pose(np.array(message.position), angles_of(anatomy, message.angles, anatomy.neutral))
    points = np.stack(body_ellipses(bdp, part_frames(anatomy, bdp, pose)))
    motion = None
    if feedback.points is not None and 0 < message.captured_ns - feedback.captured_ns <= FEEDBACK_GAP_NS:
        motion = points - feedback.points
    return replace(
        feedback, points=points, captured_ns=message.captured_ns, prediction=predicted(camera, points, motion), frames=0
    )
