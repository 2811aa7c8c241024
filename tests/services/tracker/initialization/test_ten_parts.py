"""The paper's ten parts: a body without feet is measured, with the heading of the feet in the scene."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.tracker_ring import ring
from tests.support.tracker_ring import setup as setup_of
from tests.support.tracker_scenes import rays_alone, tangent_rays, turn
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import t_pose_angles
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.initialization.localization import detect_t_pose
from zenocap.services.tracker.initialization.t_pose import TPoseFit, fit_t_poses
from zenocap.services.tracker.parameters import T_POSE_HOLD

STATURE_M = 1.8
HELD = residual_weights(replace(setup_of(ring(2)), anatomy=TEN_PARTS), T_POSE_HOLD)


@pytest.mark.nightly
@pytest.mark.parametrize("yaw_deg", [0, 100, 180, 290])
def test_ten_parts_are_measured_in_any_heading(yaw_deg: float) -> None:
    model = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, STATURE_M))
    stretched = coordinates_of(FOURTEEN_PARTS).of_pose(Pose(np.zeros(3), t_pose_angles(FOURTEEN_PARTS)))
    rotation = turn(np.array([0.0, np.radians(yaw_deg), 0.0]))
    pose = RootedPose(np.array([0.2, 0.53 * STATURE_M, -0.1]), rotation, stretched)
    seen = [rays_alone(tangent_rays(model, pose, 600, seed)) for seed in (0, 1)]
    t_poses = [detect_t_pose(one.rays) for one in seen]
    start = fit_t_poses(TEN_PARTS, seen, [one for one in t_poses if not isinstance(one, str)], HELD)
    assert isinstance(start, TPoseFit), start
    assert len(start.poses) == 2
    for found in start.poses:
        assert found.rotation[:, 2] @ rotation[:, 2] > 0.9
        assert found.position == pytest.approx(pose.position, abs=0.08)
    average = average_body(TEN_PARTS, STATURE_M)
    assert start.measured.body.sizes[:, 0] == pytest.approx(average.sizes[:, 0], rel=0.06)
