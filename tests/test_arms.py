"""An arm in the model's own silhouette is found again.  [Two-view 3.3]"""

import numpy as np
import pytest
from limb_cases import UPRIGHT, assert_consistent, begun_off, off_in_image
from two_view_scene import directions

from common.body.limbs import resting_arm
from services.viewer.arms import find_arm
from services.viewer.limb_search import BOTH, LOWER

RESTING = resting_arm(UPRIGHT, 0.0)
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
def test_an_arm_begun_20_degrees_off_is_found(viewer: int, pose: dict[str, float], off_deg: float) -> None:
    truth = directions(**pose)
    fit = begun_off(viewer, truth, 0, BOTH, off_deg)
    result = find_arm(fit, 0, RESTING, lost=False)
    assert np.max(off_in_image(fit, result.directions, truth[0])) < 6
    assert result.score > 0.97
    assert result.visible > 0.3
    np.testing.assert_array_equal(fit.directions[0], result.directions)
    assert_consistent(fit)


@pytest.mark.parametrize("off_deg", [-20, 20])
def test_an_elbow_begun_20_degrees_off_is_found(off_deg: float) -> None:
    truth = directions(**FACADE[3])
    fit = begun_off(0, truth, 0, LOWER, off_deg)
    assert (
        np.max(off_in_image(fit, find_arm(fit, 0, RESTING, lost=False).directions, truth[0])) < 14
    )  # the whole arm moves first
    assert_consistent(fit)


@pytest.mark.parametrize("k", [0, 1])
def test_a_lost_arm_is_found_all_the_way_round(k: int) -> None:
    truth = directions(right_shoulder_z=60, left_shoulder_z=300)
    fit = begun_off(0, truth, k, BOTH, 150 if k else -150)
    result = find_arm(fit, k, RESTING, lost=True)
    assert np.max(off_in_image(fit, result.directions, truth[k])) < 6
    assert_consistent(fit)


def test_an_arm_that_was_lowered_is_found_from_its_rest() -> None:
    truth = directions()
    fit = begun_off(0, truth, 0, BOTH, -120)
    result = find_arm(fit, 0, RESTING, lost=False)
    assert np.max(off_in_image(fit, result.directions, truth[0])) < 12
    assert_consistent(fit)


def test_the_search_never_matches_less_than_where_it_began_nor_moves_other_limbs() -> None:
    truth = directions(right_shoulder_z=110, right_elbow_x=50)
    fit = begun_off(1, truth, 0, BOTH, 20)  # of which the flank sees little
    before, score = fit.directions.copy(), fit.score()
    find_arm(fit, 0, RESTING, lost=False)
    assert fit.score() >= score
    np.testing.assert_array_equal(fit.directions[1:], before[1:])


def test_an_arm_behind_the_body_is_hidden_and_one_in_the_open_is_visible() -> None:
    hanging, raised = directions(), directions(left_shoulder_z=270)
    far = find_arm(begun_off(1, hanging, 1, BOTH, 0), 1, RESTING, lost=False)  # the far arm in the flank
    near = find_arm(begun_off(0, raised, 1, BOTH, 0), 1, RESTING, lost=False)
    assert far.visible < 0.2 < 0.6 < near.visible <= 1.0


def test_every_search_of_an_arm_keeps_within_the_papers_nine_matchings() -> None:
    truth = directions(right_shoulder_z=100)
    result = find_arm(begun_off(0, truth, 0, BOTH, 20), 0, RESTING, lost=False)
    assert result.matchings
    assert max(result.matchings) <= 9


def test_the_search_is_repeatable() -> None:
    truth = directions(right_shoulder_z=100)
    one, two = (find_arm(begun_off(0, truth, 0, BOTH, 20), 0, RESTING, lost=True) for _ in range(2))
    np.testing.assert_array_equal(one.directions, two.directions)
    assert (one.score, one.visible, one.matchings) == (two.score, two.visible, two.matchings)
