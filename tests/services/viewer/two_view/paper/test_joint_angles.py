"""Angles searched one after the other recover those of the model's own silhouette.  [Two-view 3.3-3.5]"""

from math import degrees, pi, radians

import numpy as np
import pytest
from hypothesis import given

from tests.support.limb_cases import UPRIGHT, assert_consistent
from tests.support.two_view_scene import ANGLES, MODEL, NAVEL, angles, degrees_between, directions, model_mask, rows
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import limb_directions, limbs_of
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.paper.joint_angles import (
    LimbAngles,
    find_arm_facade,
    find_arm_flank,
    find_leg_facade,
    find_leg_flank,
)
from zenocap.services.viewer.two_view.paper.projection import orthographic

FACADE, FLANK = 0, 1
LIMITS = TEN_PARTS.limits


def fit_of(viewer: int, **pose: float) -> BodyFit:
    """Fit over the orthographic silhouette of a pose, placed at the neutral pose."""
    camera = orthographic(rows(viewer), 5.2)
    fit = BodyFit(MODEL, camera, model_mask(camera, directions(**pose)))
    fit.place(NAVEL, UPRIGHT, directions())
    return fit


def limb_angles(k: int, values: Floats) -> LimbAngles:
    limb = limbs_of(TEN_PARTS)[k]
    return LimbAngles(*(float(values[n]) for n in (limb.z, limb.x, limb.y, limb.flexion)))


def start_of(k: int, **pose: float) -> LimbAngles:
    return limb_angles(k, angles(**pose))


def placed(fit: BodyFit, k: int, **pose: float) -> BodyFit:
    """The same fit with limb k at a pose."""
    limbs = fit.directions.copy()
    limbs[k] = directions(**pose)[k]
    fit.place(NAVEL, UPRIGHT, limbs)
    return fit


@given(ANGLES)
def test_directions_equal_those_of_the_kinematics(values: Floats) -> None:
    for k, expected in enumerate(limb_directions(TEN_PARTS, values)):
        np.testing.assert_allclose(limb_angles(k, values).directions(), expected, atol=1e-12)


@pytest.mark.parametrize(("k", "side", "z"), [(0, "right", 95), (0, "right", 130), (1, "left", 265), (1, "left", 230)])
def test_straight_arm_is_found_in_the_facade(k: int, side: str, z: float) -> None:
    start = {f"{side}_shoulder_z": z + 22.0}
    fit = placed(fit_of(FACADE, **{f"{side}_shoulder_z": z}), k, **start)
    found, result = find_arm_facade(fit, k, start_of(k, **start))
    assert abs(degrees(found.z) - z) < 6
    assert degrees(found.bend) < 12
    assert all(count <= 9 for count in result.matchings)
    np.testing.assert_allclose(result.directions, found.directions(), atol=1e-9)
    assert_consistent(fit)


@pytest.mark.parametrize("elbow", [50.0, -40.0])
def test_elbow_bends_outwards_and_inwards_in_the_facade(elbow: float) -> None:
    pose = {"right_shoulder_z": 100.0, "right_shoulder_y": 90.0 if elbow > 0 else -90.0, "right_elbow_x": abs(elbow)}
    start = {**pose, "right_elbow_x": abs(elbow) - 20}
    fit = placed(fit_of(FACADE, **pose), 0, **start)
    found = start_of(0, **start)
    for _ in range(3):  # the whole arm turns first, so that an elbow takes more than one frame
        found, _ = find_arm_facade(fit, 0, found)
    # Shoulder and elbow share the error with opposite signs, so that the hand is where it should be.
    assert np.max(degrees_between(found.directions(), directions(**pose)[0])) < 9
    assert abs(degrees(found.bend) - abs(elbow)) < 17
    assert found.y == pytest.approx(pi / 2 if elbow > 0 else -pi / 2)


def test_elbow_of_a_hanging_arm_cannot_bend_into_the_torso() -> None:
    start = {"right_shoulder_z": 178.0, "right_shoulder_y": -90.0, "right_elbow_x": 60.0}
    fit = placed(fit_of(FACADE, right_shoulder_z=178.0), 0, **start)
    found, _ = find_arm_facade(fit, 0, start_of(0, **start))
    largest = 2 * (pi - found.z)  # t_ha
    assert found.y > 0 or found.bend <= largest + 1e-9


@pytest.mark.parametrize("x", [90.0, 45.0, 130.0, -30.0])
def test_arm_is_found_in_the_flank(x: float) -> None:
    start = {"right_shoulder_x": x - 22}
    fit = placed(fit_of(FLANK, right_shoulder_x=x), 0, **start)
    found, result = find_arm_flank(fit, 0, start_of(0, **start))
    assert abs(degrees(found.x) - x) < 6
    assert len(result.matchings) == 1  # one degree of freedom


@pytest.mark.parametrize(("k", "z"), [(2, 165.0), (3, 195.0)])
def test_standing_leg_is_found_in_the_facade(k: int, z: float) -> None:
    side = "right" if k == 2 else "left"
    fit = fit_of(FACADE, **{f"{side}_hip_z": z})
    found, result = find_leg_facade(fit, k, start_of(k), LIMITS[limbs_of(TEN_PARTS)[k].z], squatting=False)
    assert abs(degrees(found.z) - z) < 5
    assert len(result.matchings) == 1
    assert result.matchings[0] <= 7


def test_squatting_legs_fold_with_the_foot_below_the_hip() -> None:
    pose = {"right_hip_x": 35.0, "right_knee_x": -70.0}
    start = {"right_hip_x": 20.0, "right_knee_x": -40.0}
    fit = placed(fit_of(FACADE, **pose), 2, **start)
    found, _ = find_leg_facade(fit, 2, start_of(2, **start), LIMITS[limbs_of(TEN_PARTS)[2].z], squatting=True)
    assert found.bend == pytest.approx(-2 * found.x)
    assert 0 <= degrees(found.x) <= 50
    assert abs(degrees(found.x) - 35) < 10


def test_hip_and_knee_are_found_in_the_flank() -> None:
    pose = {"right_hip_x": 40.0, "right_knee_x": -50.0}
    start = {"right_hip_x": 30.0, "right_knee_x": -42.0}
    limb = limbs_of(TEN_PARTS)[2]
    fit = placed(fit_of(FLANK, **pose), 2, **start)
    found, result = find_leg_flank(fit, 2, start_of(2, **start), LIMITS[limb.x], LIMITS[limb.flexion])
    assert abs(degrees(found.x) - 40) < 8
    assert abs(degrees(found.bend) + 50) < 12
    assert len(result.matchings) == 2


def test_search_region_is_moved_into_the_range_of_the_angle() -> None:
    start = {"right_shoulder_z": 172.0}  # the example of 3.5: [116, 180] degrees
    fit = placed(fit_of(FACADE, right_shoulder_z=118.0), 0, **start)
    found, _ = find_arm_facade(fit, 0, start_of(0, **start))
    assert radians(116) <= found.z <= pi
    assert abs(degrees(found.z) - 118) < 6
