"""The paper's ten parts: a body without feet is still measured, and faces the way the feet in the scene point."""

import numpy as np
import pytest

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from common.body.coordinates import coordinates_of
from common.body.definition import Pose
from common.body.proportions import stretched_angles
from services.tracker.initial import Start, measured_from, stretched_in
from services.tracker.model import model_of
from services.tracker.posed import Posed
from services.tracker.room import no_room
from services.tracker.stature import average_body
from tests.tracker_scenes import tangent_rays, turn

STATURE_M = 1.8


@pytest.mark.parametrize("yaw_deg", [0, 100, 180, 290])
def test_ten_parts_are_measured_on_a_person_with_feet_who_faces_anywhere(yaw_deg: float) -> None:
    model = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, STATURE_M))
    stretched = coordinates_of(FOURTEEN_PARTS).of_pose(Pose(np.zeros(3), stretched_angles(FOURTEEN_PARTS)))
    rotation = turn(np.array([0.0, np.radians(yaw_deg), 0.0]))
    pose = Posed(np.array([0.2, 0.53 * STATURE_M, -0.1]), rotation, stretched)
    scenes = [tangent_rays(model, pose, 600, seed) for seed in (0, 1)]
    seen = [stretched_in(rays) for rays in scenes]
    rooms = [no_room(), no_room()]
    start = measured_from(TEN_PARTS, scenes, rooms, [one for one in seen if not isinstance(one, str)])
    assert isinstance(start, Start), start
    measured = start.measured
    assert len(measured.poses) == 2
    for found in measured.poses:
        assert found.rotation[:, 2] @ rotation[:, 2] > 0.9
        assert found.position == pytest.approx(pose.position, abs=0.08)
    average = average_body(TEN_PARTS, STATURE_M)
    assert measured.body.sizes[:, 0] == pytest.approx(average.sizes[:, 0], rel=0.06)
