"""A leg in the model's own silhouette is found again.  [Two-view 3.4]"""

import numpy as np
import pytest
from limb_cases import UPRIGHT, assert_consistent, begun_off, off_in_image
from two_view_scene import MODEL, NAVEL, directions, model_mask, rows

from common.body.limbs import legs_exchanged
from services.viewer.body_fit import BodyFit
from services.viewer.legs import LEFT, RIGHT, exchange_gain, find_leg_facade, find_leg_flank
from services.viewer.limb_search import BOTH, LOWER

STANDING = directions()[RIGHT]
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
def test_a_leg_begun_20_degrees_off_is_found_in_the_flank(pose: dict[str, float], off_deg: float) -> None:
    truth = directions(**pose)
    fit = begun_off(1, truth, RIGHT, BOTH, off_deg)
    result = find_leg_flank(fit, RIGHT, STRAIGHT, lost=False)
    assert np.max(off_in_image(fit, result.directions, truth[RIGHT])) < 6
    assert result.score > 0.97
    np.testing.assert_array_equal(fit.directions[RIGHT], result.directions)
    assert_consistent(fit)


def test_a_bent_knee_is_found_in_the_flank() -> None:
    truth = directions(right_hip_x=30, right_knee_x=-50)
    fit = begun_off(1, truth, RIGHT, LOWER, 20)
    assert (
        np.max(off_in_image(fit, find_leg_flank(fit, RIGHT, STRAIGHT, lost=False).directions, truth[RIGHT])) < 10
    )  # the whole leg moves first
    assert_consistent(fit)


@pytest.mark.parametrize("k", [RIGHT, LEFT])
@pytest.mark.parametrize("off_deg", [-15, 15])
def test_a_spread_leg_is_found_in_the_facade(k: int, off_deg: float) -> None:
    truth = directions(right_hip_z=155, left_hip_z=205)
    fit = begun_off(0, truth, k, BOTH, off_deg)
    result = find_leg_facade(fit, k, squatting=False)
    assert np.max(off_in_image(fit, result.directions, truth[k])) < 6
    assert_consistent(fit)


def test_a_squatting_leg_is_folded_with_the_foot_beneath() -> None:
    folded = directions(right_hip_x=60, right_knee_x=-120, left_hip_x=60, left_knee_x=-120)
    start = directions(right_hip_x=45, right_knee_x=-90, left_hip_x=60, left_knee_x=-120)
    fit = BodyFit(MODEL, rows(0), model_mask(rows(0), folded))
    fit.place(NAVEL, UPRIGHT, start)
    before = fit.score()
    result = find_leg_facade(fit, RIGHT, squatting=True)
    assert fit.score() > before
    assert abs(np.degrees(np.arcsin(result.directions[0, 2])) - 60) < 10
    assert_consistent(fit)


@pytest.mark.parametrize("turned_deg", [-110, 110])
def test_a_lost_leg_is_found_again(turned_deg: float) -> None:
    truth = directions(right_hip_x=75, right_knee_x=-20)
    fit = begun_off(1, truth, RIGHT, BOTH, turned_deg)
    result = find_leg_flank(fit, RIGHT, STRAIGHT, lost=True)
    assert np.max(off_in_image(fit, result.directions, truth[RIGHT])) < 6
    assert_consistent(fit)


def test_knees_do_not_bend_forward() -> None:
    bent = directions(right_hip_x=20, right_knee_x=-60)
    forward = bent.copy()
    forward[RIGHT] = bent[RIGHT] * [1, 1, -1]  # a silhouette that no leg makes
    fit = begun_off(1, forward, RIGHT, BOTH, 0)
    fit.place(NAVEL, UPRIGHT, directions())
    upper, lower = find_leg_flank(fit, RIGHT, STRAIGHT, lost=True).directions
    assert upper[1] * lower[2] - upper[2] * lower[1] > -0.15


def test_every_search_of_a_leg_keeps_within_the_full_search() -> None:
    fit = begun_off(1, directions(right_hip_x=40), RIGHT, BOTH, 20)
    result = find_leg_flank(fit, RIGHT, STRAIGHT, lost=False)
    assert result.matchings
    assert max(result.matchings) <= 9
    assert max(find_leg_facade(begun_off(0, directions(), RIGHT, BOTH, 5), RIGHT, squatting=False).matchings) <= 7


def step_pose() -> np.ndarray:
    """A wide step: the right leg to the front, the left one back, as a camera above the hips tells apart."""
    return directions(right_hip_x=35, left_hip_x=-30, left_knee_x=-10)


@pytest.mark.parametrize("mistaken", [False, True])
def test_the_facade_knows_which_leg_is_in_front(mistaken: bool) -> None:
    camera = rows(0)
    truth = step_pose()
    place = NAVEL - [0.0, 0.1, 0.0]
    fit = BodyFit(MODEL, camera, model_mask(camera, truth, place))
    fit.place(place, UPRIGHT, legs_exchanged(truth) if mistaken else truth)
    assert (exchange_gain(fit) > 0) == mistaken


def test_judging_an_exchange_keeps_the_fit() -> None:
    fit = begun_off(0, step_pose(), RIGHT, BOTH, 0)
    for k in (RIGHT, LEFT):
        find_leg_facade(fit, k, squatting=False)
    expected = fit.expected.copy()
    exchange_gain(fit)
    np.testing.assert_array_equal(fit.expected, expected)
    assert_consistent(fit)
