"""The tracker's pose in a viewer, and the body image expected in its next frame."""

from dataclasses import dataclass, field, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.kinematics import body_ellipses, part_frames
from zenocap.common.camera.pinhole import Camera
from zenocap.common.messages import Message, TrackerPose
from zenocap.common.observe.bodies import NO_BODIES, Bodies, Posed, posed, source_of
from zenocap.common.vision.prediction import Prediction, predicted
from zenocap.services.viewer.parameters import FEEDBACK_FRAMES, FEEDBACK_GAP_NS


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
