"""The tracker's pose in a viewer: the prediction that it gives, and when there is none."""

from dataclasses import replace

import numpy as np
from msgspec import structs

from tests.support.built_messages import built
from tests.support.simulated_cameras import look
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.messages import TrackerBdp, TrackerPose
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.viewer.parameters import FEEDBACK_FRAMES
from zenocap.services.viewer.step import Feedback, receive

CAMERA = look("cam01", np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0])).resized((320, 240))
BODY = TrackerBdp(frame=0, captured_ns=1, body=body_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75)))


def pose(x: float, captured_ns: int) -> TrackerPose:
    upright = neutral_pose(FOURTEEN_PARTS, np.array([x, 0.95, 0.0]))
    angles = angles_by_name(FOURTEEN_PARTS, upright.angles)
    return built(TrackerPose, frame=1, captured_ns=captured_ns, position=(x, 0.95, 0.0), angles=angles)


def after(*messages: TrackerBdp | TrackerPose) -> Feedback:
    feedback = Feedback()
    for message in messages:
        feedback = receive(CAMERA, feedback, message)
    return feedback


def test_a_body_and_a_pose_give_a_prediction_where_the_person_stands() -> None:
    assert after(BODY).usable is None
    assert after(pose(0.0, 1)).usable is None  # without a body
    left, right, _, _ = after(BODY, pose(0.0, 1)).usable.extents
    assert abs((left + right) / 2 - 159.5) < 3.0


def test_the_motion_between_two_poses_goes_on() -> None:
    found = after(BODY, pose(0.0, 1), pose(0.1, 66_000_001)).usable.extents
    expected = after(BODY, pose(0.2, 1)).usable.extents
    assert abs(found.leftmost - expected.leftmost) <= 1
    late = after(BODY, pose(0.0, 1), pose(0.1, 900_000_001)).usable.extents  # too long ago: at rest
    assert late.leftmost < found.leftmost


def test_there_is_none_after_a_track_loss_nor_long_after_a_pose() -> None:
    seen = after(BODY, pose(0.0, 1))
    assert receive(CAMERA, seen, structs.replace(pose(0.0, 2), lost=True)).usable is None
    assert replace(seen, frames=FEEDBACK_FRAMES - 1).usable is not None
    assert replace(seen, frames=FEEDBACK_FRAMES).usable is None


def test_a_pose_of_another_anatomy_is_dropped() -> None:
    ten = body_of(TEN_PARTS, body_from_lengths(TEN_PARTS, average_lengths(1.75)))
    assert after(TrackerBdp(frame=0, captured_ns=1, body=ten), pose(0.0, 1)) == Feedback()
