"""Other ways the limbs may be, scored in both views."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from two_view_scene import ANGLES, MODEL, NAVEL, directions, model_mask, rows

from common.body.anatomy import TEN_PARTS, Floats
from common.body.limbs import legs_exchanged, limb_directions, resting_arm
from services.viewer.body_fit import BodyFit
from services.viewer.hypotheses import ARM_WAYS, LEG_WAYS, arm_ways, chosen, leg_ways, way_scores

RESTING = resting_arm(np.eye(3), 0.0)


@given(ANGLES)
def test_every_way_is_made_of_unit_vectors_and_the_first_is_the_expected_one(angles: Floats) -> None:
    expected = limb_directions(TEN_PARTS, angles)
    arms = arm_ways(expected, RESTING)
    assert arms.shape == (2, ARM_WAYS, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=-1), 1.0, atol=1e-3)
    np.testing.assert_array_equal(chosen(arms, 0), expected[:2])
    np.testing.assert_array_equal(chosen(leg_ways(expected), 0), expected[2:])


@given(ANGLES, st.integers(0, ARM_WAYS**2 - 1))
def test_an_index_names_one_way_of_each_limb(angles: Floats, index: int) -> None:
    ways = arm_ways(limb_directions(TEN_PARTS, angles), RESTING)
    first, second = chosen(ways, index)
    np.testing.assert_array_equal(first, ways[0, index // ARM_WAYS])
    np.testing.assert_array_equal(second, ways[1, index % ARM_WAYS])


def test_legs_in_each_others_ways_are_the_legs_exchanged() -> None:
    expected = directions(right_hip_x=30, left_hip_x=-15, left_knee_x=-20)
    both = LEG_WAYS**2 - 1
    np.testing.assert_allclose(chosen(leg_ways(expected), both), legs_exchanged(expected)[2:])


@pytest.mark.parametrize("viewer", [0, 1])
@given(ANGLES)
@settings(deadline=None, max_examples=15)  # the first example compiles
def test_the_scores_are_those_of_placing_the_whole_model(viewer: int, angles: Floats) -> None:
    expected = directions()
    fit = BodyFit(MODEL, rows(viewer), model_mask(rows(viewer), limb_directions(TEN_PARTS, angles)))
    fit.place(NAVEL, np.eye(3), expected)
    cover, totals = fit.picture.cover.copy(), fit.picture.totals.copy()
    for first, ways in ((0, arm_ways(expected, RESTING)), (2, leg_ways(expected))):
        scores = way_scores(fit, first, ways)
        np.testing.assert_array_equal(fit.picture.cover, cover)
        np.testing.assert_array_equal(fit.picture.totals, totals)
        for index, score in enumerate(scores):
            limbs = expected.copy()
            limbs[first : first + 2] = chosen(ways, index)
            fresh = BodyFit(MODEL, rows(viewer), fit.picture.mask)
            assert score == pytest.approx(np.log(fresh.place(NAVEL, np.eye(3), limbs) + 1e-3))


def test_an_arm_to_the_front_is_told_from_one_that_hangs() -> None:
    truth = directions(left_shoulder_x=90)
    total = np.zeros(ARM_WAYS**2)
    for viewer in (0, 1):
        fit = BodyFit(MODEL, rows(viewer), model_mask(rows(viewer), truth))
        fit.place(NAVEL, np.eye(3), directions())
        total += way_scores(fit, 0, arm_ways(directions(), RESTING))
    _, left = chosen(arm_ways(directions(), RESTING), int(np.argmax(total)))
    np.testing.assert_allclose(left, [[0, 0, 1], [0, 0, 1]])
