"""Limbs in the model's own silhouette are recovered.  [Two-view 3.3]"""

import numpy as np
import pytest

from tests.support.limb_cases import UPRIGHT, assert_consistent, assert_found, fit_over, fit_started_off
from tests.support.two_view_scene import NAVEL, directions
from zenocap.common.body.segments import exchange_legs, hanging_arm
from zenocap.services.viewer.two_view.joint_angles import (
    LEFT_LEG,
    RIGHT_LEG,
    find_arm,
    find_leg_facade,
    find_leg_flank,
    leg_exchange_gain,
)
from zenocap.services.viewer.two_view.limb_search import BOTH, LOWER

RESTING = hanging_arm(UPRIGHT, 0.0)
FACADE = [
    {"right_shoulder_z": 90.0, "left_shoulder_z": 270.0},
    {"right_shoulder_z": 120.0},
    {"right_shoulder_z": 60.0, "left_shoulder_z": 240.0},
    {"right_shoulder_z": 100.0, "right_shoulder_y": 90.0, "right_elbow_x": 60.0},
]
FLANK = [{"right_shoulder_x": 90.0}, {"right_shoulder_x": 60.0}, {"right_shoulder_x": 130.0}, {"right_shoulder_x": -35.0}]
CASES = [(0, pose) for pose in FACADE] + [(1, pose) for pose in FLANK]


@pytest.mark.parametrize("off_deg", [-20, 20])
@pytest.mark.parametrize(("viewer", "pose"), CASES)
def test_an_arm_is_found_from_a_start_20_degrees_off(viewer: int, pose: dict[str, float], off_deg: float) -> None:
    truth = directions(**pose)
    fit = fit_started_off(viewer, truth, 0, BOTH, off_deg)
    result = find_arm(fit, 0, RESTING, lost=False)
    assert_found(fit, 0, result.directions, truth, 6)
    assert result.score > 0.97
    assert result.visible > 0.3


RAISED = {"right_shoulder_z": 60.0, "left_shoulder_z": 300.0}


@pytest.mark.parametrize(
    ("pose", "k", "what", "off_deg", "lost", "most_deg"),
    [
        pytest.param(FACADE[3], 0, LOWER, -20, False, 14, id="elbow-up"),  # the whole arm moves first
        pytest.param(FACADE[3], 0, LOWER, 20, False, 14, id="elbow-down"),
        pytest.param(RAISED, 0, BOTH, -150, True, 6, id="lost-right-arm"),
        pytest.param(RAISED, 1, BOTH, 150, True, 6, id="lost-left-arm"),
        pytest.param({}, 0, BOTH, -120, False, 12, id="lowered-from-the-rest-pose"),
    ],
)
def test_an_elbow_and_a_lost_or_lowered_arm_are_found(pose, k, what, off_deg, lost, most_deg):
    truth = directions(**pose)
    fit = fit_started_off(0, truth, k, what, off_deg)
    assert_found(fit, k, find_arm(fit, k, RESTING, lost=lost).directions, truth, most_deg)


def test_the_search_never_lowers_the_score_or_moves_other_limbs() -> None:
    truth = directions(right_shoulder_z=110, right_elbow_x=50)
    fit = fit_started_off(1, truth, 0, BOTH, 20)  # hardly visible in the flank view
    before, score = fit.directions.copy(), fit.score()
    find_arm(fit, 0, RESTING, lost=False)
    assert fit.score() >= score
    np.testing.assert_array_equal(fit.directions[1:], before[1:])


def test_an_arm_behind_the_body_is_hidden_and_one_beside_it_is_visible() -> None:
    hanging, raised = directions(), directions(left_shoulder_z=270)
    far = find_arm(fit_started_off(1, hanging, 1, BOTH, 0), 1, RESTING, lost=False)  # the far arm in the flank
    near = find_arm(fit_started_off(0, raised, 1, BOTH, 0), 1, RESTING, lost=False)
    assert far.visible < 0.2 < 0.6 < near.visible <= 1.0


def test_the_search_is_repeatable() -> None:
    truth = directions(right_shoulder_z=100)
    one, two = (find_arm(fit_started_off(0, truth, 0, BOTH, 20), 0, RESTING, lost=True) for _ in range(2))
    np.testing.assert_array_equal(one.directions, two.directions)
    assert (one.score, one.visible, one.matchings) == (two.score, two.visible, two.matchings)


STRAIGHT = np.tile([0.0, -1.0, 0.0], (2, 1))


@pytest.mark.parametrize("off_deg", [-20, 20])
@pytest.mark.parametrize(
    "pose",
    [
        {"right_hip_x": 40.0},
        {"right_hip_x": 70.0, "right_knee_x": -60.0},
        {"right_hip_x": -25.0, "right_knee_x": -30.0},
        {"right_hip_x": 90.0, "right_knee_x": -90.0},
    ],
)
def test_a_leg_is_found_in_the_flank_from_a_start_20_degrees_off(pose: dict[str, float], off_deg: float) -> None:
    truth = directions(**pose)
    fit = fit_started_off(1, truth, RIGHT_LEG, BOTH, off_deg)
    result = find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=False)
    assert_found(fit, RIGHT_LEG, result.directions, truth, 6)
    assert result.score > 0.97


@pytest.mark.parametrize(
    ("hip_x", "knee_x", "what", "off_deg", "lost", "most_deg"),
    [
        pytest.param(30, -50, LOWER, 20, False, 10, id="bent-knee"),  # the whole leg moves first
        pytest.param(75, -20, BOTH, -110, True, 6, id="lost-leg-behind"),
        pytest.param(75, -20, BOTH, 110, True, 6, id="lost-leg-in-front"),
    ],
)
def test_a_bent_knee_and_a_lost_leg_are_found_in_the_flank(hip_x, knee_x, what, off_deg, lost, most_deg):
    truth = directions(right_hip_x=hip_x, right_knee_x=knee_x)
    fit = fit_started_off(1, truth, RIGHT_LEG, what, off_deg)
    assert_found(fit, RIGHT_LEG, find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=lost).directions, truth, most_deg)


@pytest.mark.parametrize("k", [RIGHT_LEG, LEFT_LEG])
@pytest.mark.parametrize("off_deg", [-15, 15])
def test_a_spread_leg_is_found_in_the_facade(k: int, off_deg: float) -> None:
    truth = directions(right_hip_z=155, left_hip_z=205)
    fit = fit_started_off(0, truth, k, BOTH, off_deg)
    assert_found(fit, k, find_leg_facade(fit, k, squatting=False).directions, truth, 6)


def test_a_squatting_leg_is_folded_with_the_foot_below_the_hip() -> None:
    folded = directions(right_hip_x=60, right_knee_x=-120, left_hip_x=60, left_knee_x=-120)
    start = directions(right_hip_x=45, right_knee_x=-90, left_hip_x=60, left_knee_x=-120)
    fit = fit_over(0, folded, start)
    before = fit.score()
    result = find_leg_facade(fit, RIGHT_LEG, squatting=True)
    assert fit.score() > before
    assert abs(np.degrees(np.arcsin(result.directions[0, 2])) - 60) < 10
    assert_consistent(fit)


def test_knees_do_not_bend_forward() -> None:
    bent = directions(right_hip_x=20, right_knee_x=-60)
    forward = bent.copy()
    forward[RIGHT_LEG] = bent[RIGHT_LEG] * [1, 1, -1]  # a silhouette that no leg position explains
    fit = fit_over(1, forward, directions())
    upper, lower = find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=True).directions
    assert upper[1] * lower[2] - upper[2] * lower[1] > -0.15


def test_a_search_needs_at_most_the_matchings_of_the_paper() -> None:
    arm = find_arm(fit_started_off(0, directions(right_shoulder_z=100), 0, BOTH, 20), 0, RESTING, lost=False)
    flank = fit_started_off(1, directions(right_hip_x=40), RIGHT_LEG, BOTH, 20)
    facade = fit_started_off(0, directions(), RIGHT_LEG, BOTH, 5)
    assert max(arm.matchings) <= 9
    assert max(find_leg_flank(flank, RIGHT_LEG, STRAIGHT, lost=False).matchings) <= 9
    assert max(find_leg_facade(facade, RIGHT_LEG, squatting=False).matchings) <= 7


# A wide step: the right leg to the front, the left one back, distinguishable from above the hips.
STEP = directions(right_hip_x=35, left_hip_x=-30, left_knee_x=-10)


@pytest.mark.parametrize("mistaken", [False, True])
def test_the_exchange_gain_in_the_facade_is_positive_for_exchanged_legs(mistaken: bool) -> None:
    fit = fit_over(0, STEP, exchange_legs(STEP) if mistaken else STEP, NAVEL - [0.0, 0.1, 0.0])
    assert (leg_exchange_gain(fit) > 0) == mistaken


def test_the_exchange_gain_does_not_change_the_fit() -> None:
    fit = fit_over(0, STEP, STEP)
    for k in (RIGHT_LEG, LEFT_LEG):
        find_leg_facade(fit, k, squatting=False)
    before = fit.directions.copy()
    leg_exchange_gain(fit)
    np.testing.assert_array_equal(fit.directions, before)
    assert_consistent(fit)
