"""Overlapped tri-tree against the full search, and its matchings.  [Two-view 3.5, Eq. 2]"""

from typing import NamedTuple
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.limb_cases import fit_over
from tests.support.two_view_scene import MODEL, NAVEL, directions, model_mask, rows
from zenocap.common.arrays import Floats
from zenocap.common.vision.model_image import ADD, COUNT, REMOVE
from zenocap.services.viewer.parameters import ARM_REGION, LEG_REGION, STOP
from zenocap.services.viewer.two_view import limb_search
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_search import (
    BOTH,
    FOLD,
    LOWER,
    UPPER,
    CoverImage,
    LimbBody,
    add_limb,
    cover_limb,
    full_search,
    is_allowed,
    limb_score,
    segment_frame,
    slant_axis,
    tri_tree,
    turn_limb,
)

X_AXIS, Z_AXIS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
DOWN = np.tile([0.0, -1.0, 0.0], (2, 1))
REGIONS = [(ARM_REGION, 6, 9, 17), (LEG_REGION, 5, 7, 9)]  # least, most, full
LONG = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)
UNIT = LONG.map(lambda v: v / np.linalg.norm(v))


def turned(what: int, angle: float, axis: Floats = Z_AXIS, start: Floats = DOWN) -> Floats:
    out = np.empty((2, 3))
    turn_limb(start, axis, what, angle, out)
    return out


def unobserved_limb() -> tuple[LimbBody, CoverImage]:
    """A limb behind the camera of an empty image: every allowed direction has the same score."""
    image = CoverImage(np.eye(3), rows(0), np.zeros((8, 8), np.uint8), np.zeros((8, 8), np.uint8), np.zeros(3, np.int64))
    return LimbBody(np.array([0.0, 1.0, 9.0]), np.full((2, 3), 0.1), False), image


class ScriptedSearch(NamedTuple):
    """A tri-tree over scripted scores: its result, and the scored angles in whole degrees."""

    best_deg: float
    score: float
    matchings: int
    evaluated_deg: list[int]


def scripted_search(scores: dict[int, float], region: float) -> ScriptedSearch:
    """scores: by angle in whole degrees, 0 elsewhere."""
    evaluated: list[int] = []

    def score(_d: Floats, _a: Floats, _w: int, angle: float, _l: LimbBody, _p: CoverImage) -> float:
        evaluated.append(round(np.degrees(angle)))
        return scores.get(evaluated[-1], 0.0)

    with patch.object(limb_search, "limb_score", score):
        best, best_score, matchings = tri_tree.py_func(DOWN, Z_AXIS, BOTH, region, *unobserved_limb())
    return ScriptedSearch(float(np.degrees(best)), best_score, matchings, evaluated)


@pytest.mark.parametrize(("region", "least", "most", "full"), REGIONS)
@given(target=st.floats(-1.0, 1.0))
def test_the_tri_tree_equals_the_full_search_on_a_unimodal_score(region, least, most, full, target):
    with patch.object(limb_search, "limb_score", lambda _d, _a, _s, angle, _l, _i: np.cos(angle - target)):
        _, score, matchings = tri_tree.py_func(DOWN, Z_AXIS, BOTH, region, *unobserved_limb())
        _, best_score, all_matchings = full_search.py_func(DOWN, Z_AXIS, BOTH, region, STOP, *unobserved_limb())
    assert score == pytest.approx(best_score, abs=1e-12)
    assert least <= matchings <= most
    assert all_matchings == full


@pytest.mark.parametrize(("region", "least", "most", "full"), REGIONS)
def test_least_and_most_matchings_occur(region: float, least: int, most: int, full: int) -> None:
    for best, matchings in ((-round(np.degrees(region)) // 2, least), (0, most)):
        found = scripted_search({best: 1.0}, region)
        assert found.matchings == len(found.evaluated_deg) == matchings
        assert len(set(found.evaluated_deg)) == matchings  # a known score is not computed again


def test_a_tie_keeps_the_start_angle() -> None:
    assert scripted_search({}, ARM_REGION).best_deg == 0.0
    assert full_search(DOWN, Z_AXIS, BOTH, ARM_REGION, STOP, *unobserved_limb())[0] == pytest.approx(0.0, abs=1e-12)


@given(st.floats(-0.5, 0.5), st.floats(-0.4, 0.4))
@settings(deadline=None)
def test_a_search_restores_the_cover_and_returns_the_score_of_its_angle(start: float, region_share: float) -> None:
    truth = directions(right_shoulder_z=120, right_elbow_x=30)
    limbs = truth.copy()
    limbs[0] = turned(BOTH, start, start=limbs[0])
    fit = fit_over(0, truth, limbs)
    fit.cover_limb(0, REMOVE)
    cover, totals = fit.image.cover.copy(), fit.image.totals.copy()
    region = ARM_REGION * (1 + region_share)
    angle, score, _ = tri_tree(limbs[0], Z_AXIS, BOTH, region, fit.limb_body(0), fit.image)
    full_search(limbs[0], Z_AXIS, LOWER, region, STOP, fit.limb_body(0), fit.image)
    np.testing.assert_array_equal(fit.image.cover, cover)
    np.testing.assert_array_equal(fit.image.totals, totals)
    limbs[0] = turned(BOTH, angle, start=limbs[0])
    assert fit.place(NAVEL, np.eye(3), limbs) == pytest.approx(score)


def test_forbidden_angles_have_a_score_of_minus_1() -> None:
    limb, image = unobserved_limb()
    assert limb_score(DOWN, X_AXIS, LOWER, np.radians(149), limb, image) >= 0
    assert limb_score(DOWN, X_AXIS, LOWER, np.radians(151), limb, image) == -1.0
    assert limb_score(DOWN, X_AXIS, LOWER, np.radians(-60), limb, image) >= 0  # an elbow, in either direction
    leg = limb._replace(is_leg=True)
    scores = [limb_score(DOWN, X_AXIS, LOWER, np.radians(turn), leg, image) for turn in (60, -60)]
    assert sorted(score == -1.0 for score in scores) == [False, True]


@given(st.floats(0, 148))
@settings(deadline=None)
def test_a_knee_bends_backward_and_not_forward(bend_deg: float) -> None:
    backward = directions(right_knee_x=-bend_deg)[2]
    assert is_allowed(backward, True)
    forward = backward * [1, 1, -1]
    assert not is_allowed(forward, True) or bend_deg < 8  # tolerance for small bends
    assert is_allowed(forward, False)


def test_elbows_and_knees_do_not_fold_past_150_degrees() -> None:
    assert not is_allowed(np.array([[0.0, -1.0, 0.0], [0.0, np.cos(np.radians(29)), np.sin(np.radians(29))]]), False)


@given(UNIT, st.floats(-1.5, 1.5))
@settings(deadline=None)
def test_each_mode_turns_its_segments_about_the_axis(axis: Floats, angle: float) -> None:
    start = directions(right_shoulder_z=100, right_elbow_x=50)[0]
    both, lower, upper = (turned(what, angle, axis, start) for what in (BOTH, LOWER, UPPER))
    np.testing.assert_allclose([both[0], both[1]], [upper[0], lower[1]])
    np.testing.assert_array_equal(lower[0], start[0])
    np.testing.assert_array_equal(upper[1], start[1])
    np.testing.assert_allclose(np.linalg.norm(both, axis=1), 1.0)
    np.testing.assert_allclose(both @ axis, start @ axis, atol=1e-12)


@given(st.floats(0.0, 1.3))
@settings(deadline=None)
def test_a_fold_keeps_the_foot_below_the_hip(angle: float) -> None:
    upper, lower = turned(FOLD, angle, -X_AXIS)
    np.testing.assert_allclose((upper + lower)[[0, 2]], 0.0, atol=1e-12)
    assert upper[2] >= 0 >= lower[2]  # the knee goes to the front
    assert is_allowed(np.array([upper, lower]), True)


@given(UNIT)
@settings(deadline=None)
def test_a_segments_frame_is_a_rotation_along_it(along: Floats) -> None:
    frame = np.empty((3, 4))
    segment_frame(NAVEL, along, np.eye(3), frame)
    np.testing.assert_allclose(frame[:, 1], along)
    np.testing.assert_allclose(frame[:, :3] @ frame[:, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame[:, :3]) > 0
    np.testing.assert_array_equal(frame[:, 3], NAVEL)


@given(UNIT, UNIT)
@settings(deadline=None)
def test_a_part_slants_about_an_axis_in_the_image_plane(view: Floats, direction: Floats) -> None:
    if abs(view[1]) < 0.99:  # no camera looks straight down
        axis = slant_axis(view, direction)
        assert np.linalg.norm(axis) == pytest.approx(1.0)
        assert axis @ view == pytest.approx(0.0, abs=1e-9)


def test_count_mode_gives_the_totals_of_adding_a_limb_without_changing_the_cover() -> None:
    limbs = directions(right_shoulder_z=150, right_elbow_x=140)  # both parts overlap
    fit = BodyFit(MODEL, rows(1), model_mask(rows(0), limbs))
    fit.place(NAVEL, np.eye(3), limbs)
    fit.cover_limb(0, REMOVE)
    before, counted = fit.image.cover.copy(), fit.image.totals.copy()
    cover_limb(limbs[0], fit.limb_body(0), fit.image, COUNT, counted)
    np.testing.assert_array_equal(fit.image.cover, before)
    fit.cover_limb(0, ADD)
    np.testing.assert_array_equal(counted, fit.image.totals)


def test_adding_a_limb_returns_the_pixels_that_no_other_part_but_its_twin_covers() -> None:
    limbs = directions(right_shoulder_x=60, left_shoulder_x=60)  # one behind the other from the side
    fit = fit_over(1, limbs, limbs)
    whole, totals = fit.image.cover.copy(), fit.image.totals.copy()
    fit.cover_limb(0, REMOVE)
    own, inside = add_limb(limbs[0], fit.limb_body(0), limbs[1], fit.limb_body(1), fit.image)
    np.testing.assert_array_equal(fit.image.cover, whole)
    np.testing.assert_array_equal(fit.image.totals, totals)
    fit.cover_limb(1, REMOVE)
    pixels_with_limb = np.count_nonzero(fit.image.cover)
    fit.cover_limb(0, REMOVE)
    assert own == pixels_with_limb - np.count_nonzero(fit.image.cover)
    assert inside == own > 0
