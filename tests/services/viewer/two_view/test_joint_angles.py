"""Limbs in the model's own silhouette are recovered.  [Two-view 3.3]"""

import numpy as np
import pytest

from tests.support.limb_cases import UPRIGHT, assert_consistent, fit_started_off, image_errors_deg
from tests.support.two_view_scene import MODEL, NAVEL, directions, model_mask, rows
from zenocap.common.body.segments import exchange_legs, hanging_arm
from zenocap.services.viewer.two_view.body_fit import BodyFit
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
    assert np.max(image_errors_deg(fit, result.directions, truth[0])) < 6
    assert result.score > 0.97
    assert result.visible > 0.3
    np.testing.assert_array_equal(fit.directions[0], result.directions)
    assert_consistent(fit)


@pytest.mark.parametrize("off_deg", [-20, 20])
def test_an_elbow_is_found_from_a_start_20_degrees_off(off_deg: float) -> None:
    truth = directions(**FACADE[3])
    fit = fit_started_off(0, truth, 0, LOWER, off_deg)
    assert (
        np.max(image_errors_deg(fit, find_arm(fit, 0, RESTING, lost=False).directions, truth[0])) < 14
    )  # the whole arm moves first
    assert_consistent(fit)


@pytest.mark.parametrize("k", [0, 1])
def test_a_lost_arm_is_found_at_any_angle(k: int) -> None:
    truth = directions(right_shoulder_z=60, left_shoulder_z=300)
    fit = fit_started_off(0, truth, k, BOTH, 150 if k else -150)
    result = find_arm(fit, k, RESTING, lost=True)
    assert np.max(image_errors_deg(fit, result.directions, truth[k])) < 6
    assert_consistent(fit)


def test_a_lowered_arm_is_found_from_the_rest_pose() -> None:
    truth = directions()
    fit = fit_started_off(0, truth, 0, BOTH, -120)
    result = find_arm(fit, 0, RESTING, lost=False)
    assert np.max(image_errors_deg(fit, result.directions, truth[0])) < 12
    assert_consistent(fit)


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


def test_an_arm_search_needs_at_most_the_nine_matchings_of_the_paper() -> None:
    truth = directions(right_shoulder_z=100)
    result = find_arm(fit_started_off(0, truth, 0, BOTH, 20), 0, RESTING, lost=False)
    assert result.matchings
    assert max(result.matchings) <= 9


def test_the_search_is_repeatable() -> None:
    truth = directions(right_shoulder_z=100)
    one, two = (find_arm(fit_started_off(0, truth, 0, BOTH, 20), 0, RESTING, lost=True) for _ in range(2))
    np.testing.assert_array_equal(one.directions, two.directions)
    assert (one.score, one.visible, one.matchings) == (two.score, two.visible, two.matchings)


STANDING = directions()[RIGHT_LEG]
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
    assert np.max(image_errors_deg(fit, result.directions, truth[RIGHT_LEG])) < 6
    assert result.score > 0.97
    np.testing.assert_array_equal(fit.directions[RIGHT_LEG], result.directions)
    assert_consistent(fit)


def test_a_bent_knee_is_found_in_the_flank() -> None:
    truth = directions(right_hip_x=30, right_knee_x=-50)
    fit = fit_started_off(1, truth, RIGHT_LEG, LOWER, 20)
    assert (
        np.max(image_errors_deg(fit, find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=False).directions, truth[RIGHT_LEG]))
        < 10
    )  # the whole leg moves first
    assert_consistent(fit)


@pytest.mark.parametrize("k", [RIGHT_LEG, LEFT_LEG])
@pytest.mark.parametrize("off_deg", [-15, 15])
def test_a_spread_leg_is_found_in_the_facade(k: int, off_deg: float) -> None:
    truth = directions(right_hip_z=155, left_hip_z=205)
    fit = fit_started_off(0, truth, k, BOTH, off_deg)
    result = find_leg_facade(fit, k, squatting=False)
    assert np.max(image_errors_deg(fit, result.directions, truth[k])) < 6
    assert_consistent(fit)


def test_a_squatting_leg_is_folded_with_the_foot_below_the_hip() -> None:
    folded = directions(right_hip_x=60, right_knee_x=-120, left_hip_x=60, left_knee_x=-120)
    start = directions(right_hip_x=45, right_knee_x=-90, left_hip_x=60, left_knee_x=-120)
    fit = BodyFit(MODEL, rows(0), model_mask(rows(0), folded))
    fit.place(NAVEL, UPRIGHT, start)
    before = fit.score()
    result = find_leg_facade(fit, RIGHT_LEG, squatting=True)
    assert fit.score() > before
    assert abs(np.degrees(np.arcsin(result.directions[0, 2])) - 60) < 10
    assert_consistent(fit)


@pytest.mark.parametrize("turned_deg", [-110, 110])
def test_a_lost_leg_is_found_again(turned_deg: float) -> None:
    truth = directions(right_hip_x=75, right_knee_x=-20)
    fit = fit_started_off(1, truth, RIGHT_LEG, BOTH, turned_deg)
    result = find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=True)
    assert np.max(image_errors_deg(fit, result.directions, truth[RIGHT_LEG])) < 6
    assert_consistent(fit)


def test_knees_do_not_bend_forward() -> None:
    bent = directions(right_hip_x=20, right_knee_x=-60)
    forward = bent.copy()
    forward[RIGHT_LEG] = bent[RIGHT_LEG] * [1, 1, -1]  # a silhouette that no leg position explains
    fit = fit_started_off(1, forward, RIGHT_LEG, BOTH, 0)
    fit.place(NAVEL, UPRIGHT, directions())
    upper, lower = find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=True).directions
    assert upper[1] * lower[2] - upper[2] * lower[1] > -0.15


def test_a_leg_search_needs_no_more_matchings_than_the_full_search() -> None:
    fit = fit_started_off(1, directions(right_hip_x=40), RIGHT_LEG, BOTH, 20)
    result = find_leg_flank(fit, RIGHT_LEG, STRAIGHT, lost=False)
    assert result.matchings
    assert max(result.matchings) <= 9
    assert (
        max(find_leg_facade(fit_started_off(0, directions(), RIGHT_LEG, BOTH, 5), RIGHT_LEG, squatting=False).matchings)
        <= 7
    )


def step_pose() -> np.ndarray:
    """A wide step: the right leg to the front, the left one back, distinguishable from above the hips."""
    return directions(right_hip_x=35, left_hip_x=-30, left_knee_x=-10)


@pytest.mark.parametrize("mistaken", [False, True])
def test_the_exchange_gain_in_the_facade_is_positive_for_exchanged_legs(mistaken: bool) -> None:
    camera = rows(0)
    truth = step_pose()
    place = NAVEL - [0.0, 0.1, 0.0]
    fit = BodyFit(MODEL, camera, model_mask(camera, truth, place))
    fit.place(place, UPRIGHT, exchange_legs(truth) if mistaken else truth)
    assert (leg_exchange_gain(fit) > 0) == mistaken


def test_the_exchange_gain_does_not_change_the_fit() -> None:
    fit = fit_started_off(0, step_pose(), RIGHT_LEG, BOTH, 0)
    for k in (RIGHT_LEG, LEFT_LEG):
        find_leg_facade(fit, k, squatting=False)
    directions = fit.directions.copy()
    leg_exchange_gain(fit)
    np.testing.assert_array_equal(fit.directions, directions)
    assert_consistent(fit)
