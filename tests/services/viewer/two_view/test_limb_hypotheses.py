"""Alternative limb hypotheses, scored in both views."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.limb_cases import fit_over
from tests.support.two_view_scene import ANGLES, MODEL, NAVEL, directions, rows
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import exchange_legs, hanging_arm, limb_directions
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_hypotheses import (
    ARM_HYPOTHESES,
    LEG_HYPOTHESES,
    arm_hypotheses,
    combination,
    hypothesis_scores,
    leg_hypotheses,
)

RESTING = hanging_arm(np.eye(3), 0.0)


@given(ANGLES)
def test_hypotheses_are_unit_vectors_and_the_first_one_is_the_last_pose(angles: Floats) -> None:
    last = limb_directions(TEN_PARTS, angles)
    arms = arm_hypotheses(last, RESTING)
    assert arms.shape == (2, ARM_HYPOTHESES, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=-1), 1.0, atol=1e-3)
    np.testing.assert_array_equal(combination(arms, 0), last[:2])
    np.testing.assert_array_equal(combination(leg_hypotheses(last), 0), last[2:])


@given(ANGLES, st.integers(0, ARM_HYPOTHESES**2 - 1))
def test_an_index_selects_one_hypothesis_of_each_limb(angles: Floats, index: int) -> None:
    hypotheses = arm_hypotheses(limb_directions(TEN_PARTS, angles), RESTING)
    first, second = combination(hypotheses, index)
    np.testing.assert_array_equal(first, hypotheses[0, index // ARM_HYPOTHESES])
    np.testing.assert_array_equal(second, hypotheses[1, index % ARM_HYPOTHESES])


def test_the_last_hypothesis_of_the_legs_exchanges_them() -> None:
    last = directions(right_hip_x=30, left_hip_x=-15, left_knee_x=-20)
    both = LEG_HYPOTHESES**2 - 1
    np.testing.assert_allclose(combination(leg_hypotheses(last), both), exchange_legs(last)[2:])


@pytest.mark.slow
@pytest.mark.parametrize("viewer", [0, 1])
@given(ANGLES)
@settings(deadline=None, max_examples=15)  # the first example compiles
def test_hypothesis_scores_equal_those_of_the_whole_model(viewer: int, angles: Floats) -> None:
    last = directions()
    fit = fit_over(viewer, limb_directions(TEN_PARTS, angles), last)
    cover, totals = fit.image.cover.copy(), fit.image.totals.copy()
    for first, hypotheses in ((0, arm_hypotheses(last, RESTING)), (2, leg_hypotheses(last))):
        scores = hypothesis_scores(fit, first, hypotheses)
        np.testing.assert_array_equal(fit.image.cover, cover)
        np.testing.assert_array_equal(fit.image.totals, totals)
        for index, score in enumerate(scores):
            limbs = last.copy()
            limbs[first : first + 2] = combination(hypotheses, index)
            fresh = BodyFit(MODEL, rows(viewer), fit.image.mask)
            assert score == pytest.approx(np.log(fresh.place(NAVEL, np.eye(3), limbs) + 1e-3))


def test_an_arm_to_the_front_is_distinguished_from_a_hanging_one() -> None:
    truth = directions(left_shoulder_x=90)
    total = np.zeros(ARM_HYPOTHESES**2)
    for viewer in (0, 1):
        total += hypothesis_scores(fit_over(viewer, truth, directions()), 0, arm_hypotheses(directions(), RESTING))
    _, left = combination(arm_hypotheses(directions(), RESTING), int(np.argmax(total)))
    np.testing.assert_allclose(left, [[0, 0, 1], [0, 0, 1]])
