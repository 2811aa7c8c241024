"""Body model of compiled functions against the anatomy's kinematics and limits."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import MODEL, average_model, frames_of, turn, upright
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.kinematics import part_frames
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import MAX_BALL_ANGLE, local_rotation, model_of


@each_anatomy
@pytest.mark.parametrize("seed", range(5))
def test_forward_kinematics_equal_those_of_the_anatomy(anatomy: Anatomy, seed: int) -> None:
    body, pose = average_body(anatomy, 1.7), upright(anatomy, seed, spread=1.0)
    expected = part_frames(anatomy, body, pose.pose(anatomy))
    assert frames_of(model_of(anatomy, body), pose) == pytest.approx(expected, abs=1e-9)


@each_anatomy
def test_round_cap_of_a_free_end_is_within_the_parts_length(anatomy: Anatomy) -> None:
    body = average_body(anatomy, 1.7)
    model = model_of(anatomy, body)
    tips = body.far_radii
    for k, part in enumerate(anatomy.parts):
        carries = any(joint.parent == part for joint in anatomy.joints)
        assert model.free[k] == (0.0 if carries else 1.0)
        cap = 0.0 if carries else tips[k].mean()
        assert model.lengths[k] + cap == pytest.approx(max(body.sizes[k, 0], 0.01 + cap))
        assert model.radii[k] == pytest.approx([*body.sizes[k, 1:], *tips[k]])


@each_anatomy
def test_ranges_are_hinge_limits_or_a_cube(anatomy: Anatomy) -> None:
    model, coordinates = average_model(anatomy), coordinates_of(anatomy)
    assert np.all(model.low < model.high)
    for k, joint in enumerate(anatomy.joints[1:], 1):
        start = int(coordinates.first[k])
        if len(joint.axes) == 1:
            assert (model.low[start], model.high[start]) == joint.limits[0]
        elif "shoulder" in joint.name or "hip" in joint.name:
            assert np.all(model.high[start : start + 3] == MAX_BALL_ANGLE)
        elif joint.axes:
            assert model.high[start + "xyz".index("x")] == joint.limits[joint.axes.index("x")][1]


def test_zero_of_a_ball_joint_is_the_middle_of_its_range() -> None:
    coordinates, index = coordinates_of(FOURTEEN_PARTS), FOURTEEN_PARTS.index
    shoulder, elbow = index["right_upper_arm"], index["right_lower_arm"]
    values, scratch, local = np.zeros(coordinates.dimension), np.empty((3, 3)), np.empty((3, 3))
    local_rotation(MODEL, shoulder, values, scratch, local)
    assert local == pytest.approx(coordinates.reference[shoulder])
    assert local[:, 1] @ np.array([-0.5, -0.6, 0.6]) > 0.98 * np.linalg.norm([0.5, 0.6, 0.6])
    values[coordinates.first[elbow]] = 0.8
    local_rotation(MODEL, elbow, values, scratch, local)
    assert local == pytest.approx(turn(np.array([0.8, 0.0, 0.0])))
