"""Takes that the tests of exports share: of either method, with frames without a pose."""

from pathlib import Path

import numpy as np

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.services.tracker.body.average_body import average_body

FIRST, COUNT, MISSING = 4, 40, (7, 8, 9)  # of the take of two-view: first frame, rows, rows without a person
TRACKED, LOST, UNSURE = 12, 5, 3  # of the take of the tracker: frames, the one without a person, that of the left arm
LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")
BODY = average_body(FOURTEEN_PARTS, 1.75)


def two_view_take(path: Path) -> Path:
    return write_take(path, messages_of_track(moving(COUNT, first=FIRST, lost=MISSING, rate=30.0)))


def tracked_poses() -> list[Pose]:
    """Poses near the T-pose of a person who moves to the left."""
    random = np.random.default_rng(3)
    start = t_pose_angles(FOURTEEN_PARTS)
    return [Pose(np.array([0.1 * k, 0.9, 0.0]), start + random.uniform(-0.3, 0.3, len(start))) for k in range(TRACKED)]


def tracked_take(path: Path) -> Path:
    """Of the tracker, with feet; the left arm is uncertain in one frame, the person lost in another."""
    body = m.TrackerBdp(frame=0, captured_ns=START_NS, body=body_of(FOURTEEN_PARTS, BODY))
    found: list[m.Message] = [messages_of_track(moving(2))[0], body]
    for frame, pose in enumerate(tracked_poses()):
        x, y, z = pose.position.tolist()
        unsure = frame == UNSURE
        found.append(
            built(
                m.TrackerPose, frame=frame, captured_ns=START_NS + round(frame * 1e9 / 30), position=(x, y, z),
                angles=angles_by_name(FOURTEEN_PARTS, pose.angles), lost=frame == LOST, views=["1"], heading=0.97,
                limbs=dict.fromkeys(LIMBS, 0.9) | ({"left_arm": 0.2} if unsure else {}),
                lost_limbs=["left_arm"] if unsure else [],
            )
        )  # fmt: skip
    return write_take(path, found)
