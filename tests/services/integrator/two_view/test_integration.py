"""Universal BAP from two views' limbs.  [Two-view 4.4]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.two_view_scene import ANGLES, degrees_between, directions
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import YAW_OFFSETS, hanging_arm, limb_directions, torso_rotation
from zenocap.services.integrator.parameters import EXCHANGE_AT, EXCHANGE_FLOOR, MOST_TURN
from zenocap.services.integrator.two_view.integration import (
    ViewedLimbs,
    best_hypotheses,
    exchange_evidence,
    integrate_limbs,
    is_squatting,
    spine_after,
    turn_of_body,
)

Z_VIEW, X_VIEW = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
RESTING = hanging_arm(np.eye(3), 0.0)
FULLY_VISIBLE = np.ones(4)


def seen(truth: Floats, axis: Floats, slant: Floats | float, visible: Floats = FULLY_VISIBLE) -> ViewedLimbs:
    """Directions from an ideal view: exact across its axis, arbitrary along it.  slant: (4, 2) or one number."""
    across = truth - (truth @ axis)[..., None] * axis
    along = np.broadcast_to(np.asarray(slant), (4, 2))[..., None] * axis
    return ViewedLimbs(across + along, visible, axis)


@given(ANGLES)
def test_two_orthogonal_views_recover_the_direction(angles: Floats) -> None:
    truth = limb_directions(TEN_PARTS, angles)
    merged = integrate_limbs([seen(truth, axis, truth @ axis) for axis in (Z_VIEW, X_VIEW)], RESTING, squatting=False)
    np.testing.assert_allclose(np.linalg.norm(merged, axis=2), 1.0)
    assert np.max(degrees_between(merged[2:], truth[2:])) < 1e-3
    assert np.max(degrees_between(merged[:2], truth[:2])) < 3  # the rest pose of the arm has a small weight


@given(ANGLES)
def test_the_direction_along_the_axis_of_a_view_has_little_weight(angles: Floats) -> None:
    """Each view gives a slant of 0 along its axis, which it does not observe; the other view observes it."""
    truth = limb_directions(TEN_PARTS, angles)
    merged = integrate_limbs([seen(truth, axis, 0.0) for axis in (Z_VIEW, X_VIEW)], RESTING, squatting=False)
    assert np.max(degrees_between(merged, truth)) < 12


@given(ANGLES)
def test_the_order_of_the_views_does_not_matter(angles: Floats) -> None:
    truth = limb_directions(TEN_PARTS, angles)
    views = [seen(truth, Z_VIEW, 0.3), seen(truth, X_VIEW, -0.2, np.array([0.1, 0.9, 0.5, 0.5]))]
    np.testing.assert_allclose(
        integrate_limbs(views, RESTING, False), integrate_limbs(views[::-1], RESTING, False), atol=1e-9
    )


def test_a_view_with_a_visible_arm_has_more_weight() -> None:
    right, wrong = directions(left_shoulder_x=90), directions(left_shoulder_x=0)
    hidden, shown = np.array([1.0, 0.0, 1.0, 1.0]), FULLY_VISIBLE
    views = [ViewedLimbs(right, shown, Z_VIEW), ViewedLimbs(wrong, hidden, np.array([0.6, 0.0, -0.8]))]
    assert degrees_between(integrate_limbs(views, RESTING, False)[1, 0], right[1, 0]) < 20


STAND = np.pi


@pytest.mark.parametrize(
    ("height", "spread_deg", "squatting"),
    [
        (0.95, 0, False),  # standing
        (1.20, 17, False),  # jumping
        *((0.88, spread, False) for spread in (0, 3)),  # 7 cm lower on straight legs: one is lifted
        *((0.80, spread, True) for spread in (0, 3, 12)),
        (0.88, 12, True),  # spread knees and a lowered navel
        (0.94, 12, False),
    ],
)
def test_squatting(height: float, spread_deg: float, squatting: bool) -> None:
    spread = float(np.radians(spread_deg))
    assert is_squatting(height, 0.95, (STAND - spread, STAND + spread)) is squatting


@given(st.floats(0.3, 1.2), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_squatting_is_symmetric_in_the_legs(height: float, right: float, left: float) -> None:
    one = is_squatting(height, 0.95, (STAND - right, STAND + left))
    assert one == is_squatting(height, 0.95, (STAND - left, STAND + right))


def profile(best: float, steepness: float = -8.0) -> list[float]:
    """Log scores around a best turn in radians."""
    return (steepness * (YAW_OFFSETS - best) ** 2).tolist()


@pytest.mark.parametrize(
    "profiles",
    [[[-0.2] * len(YAW_OFFSETS)] * 2, [profile(0.0)] * 2, [profile(0.14), profile(-0.14)]],
    ids=["flat", "best without a turn", "contradicting"],
)
def test_without_evidence_the_body_does_not_turn(profiles: list[list[float]]) -> None:
    assert turn_of_body(profiles, YAW_OFFSETS, 0.0) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-0.2, 0.2), st.floats(-0.7, 0.7))
def test_turning_is_mirrored_and_bounded(best: float, off_axis: float) -> None:
    turn = turn_of_body([profile(best)] * 2, YAW_OFFSETS, off_axis)
    mirrored = turn_of_body([profile(-best)] * 2, YAW_OFFSETS, -off_axis)
    assert turn == pytest.approx(-mirrored, abs=1e-9)
    assert abs(turn) <= MOST_TURN


def test_strong_evidence_turns_the_body_in_its_direction() -> None:
    strong = profile(np.radians(8), -80.0)
    assert turn_of_body([strong, strong], YAW_OFFSETS, 0.0) > np.radians(4)


@given(st.lists(st.floats(-1, 1), max_size=30))
def test_evidence_stays_within_its_bounds(gains: list[float]) -> None:
    evidence = 0.0
    for gain in gains:
        evidence, mistaken = exchange_evidence(evidence, gain)
        assert EXCHANGE_FLOOR <= evidence <= EXCHANGE_AT
        assert not mistaken or evidence == 0.0


def test_negative_evidence_decays() -> None:
    evidence, mistaken = EXCHANGE_FLOOR, False
    for _ in range(100):
        evidence, mistaken = exchange_evidence(evidence, -0.015)
        assert not mistaken
    assert abs(evidence) < 0.01


@given(st.floats(-0.25, 0.25), st.floats(-0.25, 0.25))
def test_the_spine_follows_both_views_tilts(about_z: float, about_x: float) -> None:
    up = np.array([0.0, 1.0, 0.0])
    moved = spine_after(up, [(about_z, np.array([0.0, 0.0, -1.0])), (about_x, np.array([1.0, 0.0, 0.0]))])
    assert np.linalg.norm(moved) == pytest.approx(1.0)
    # In a view along an axis, the spine is turned about that axis by the measured angle.
    assert np.arctan2(moved[0], moved[1]) == pytest.approx(np.arctan(np.sin(about_z)), abs=1e-9)
    assert np.arctan2(moved[2], moved[1]) == pytest.approx(np.arctan(np.sin(about_x)), abs=1e-9)


def test_a_tilt_forward_seen_by_the_flank_is_a_lean() -> None:
    rotation = torso_rotation(0.0, 0.2, 0.0)
    moved = spine_after(np.array([0.0, 1.0, 0.0]), [(0.2, X_VIEW)])
    np.testing.assert_allclose(moved, rotation[:, 1], atol=0.01)


@given(st.integers(0, 35), st.lists(st.floats(-0.5, 0.0), min_size=36, max_size=36))
def test_the_best_hypothesis_has_the_largest_sum_over_both_views(best_index: int, noise: list[float]) -> None:
    profiles = np.array([noise, noise[::-1]])
    profiles[:, best_index] += 3.0
    assert best_hypotheses(profiles.tolist(), 0.03) == best_index


@pytest.mark.parametrize(
    ("hypothesis", "cost", "best"),
    [(1, 0.04, 1), (1, 0.06, 0), (7, 0.04, 0)],  # hypothesis 1 changes the second limb, 7 both
)
def test_another_hypothesis_must_gain_its_cost_for_every_limb_that_changes(hypothesis: int, cost: float, best: int) -> None:
    profile = [0.0] * 36
    profile[hypothesis] = 0.05
    assert best_hypotheses([profile], cost) == best


@pytest.mark.parametrize("profiles", [[], [[]], [[0.0] * 36, [0.0, 9.0, 0.0, 0.0]]])
def test_profiles_of_other_lengths_keep_the_expected_hypothesis(profiles: list[list[float]]) -> None:
    assert best_hypotheses(profiles, 0.03) == 0
