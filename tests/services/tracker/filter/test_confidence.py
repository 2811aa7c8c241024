"""Confidence of limbs and heading: laws of the models, misplaced silhouettes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.tracker_ring import fit_of, ring, setup, shown, t_pose_at
from tests.support.tracker_scenes import average_model
from zenocap.services.tracker.body.body_model import model_of
from zenocap.services.tracker.filter.confidence import (
    FEATURES,
    LIMBS,
    ambiguity,
    heading_confidence,
    limb_confidence,
    limb_distances,
    limb_features,
    smoothed_features,
)
from zenocap.services.tracker.filter.limb_search import limb_support, limbs_of
from zenocap.services.tracker.initialization.postures import search_postures

CAMERAS = ring(4)
ANATOMY = setup(CAMERAS).anatomy
SHARES = st.floats(0.0, 1.2)


@given(support=SHARES, more=SHARES, misfit=st.floats(-14.0, -4.0), body=SHARES, apart=st.floats(0.0, 0.5))
def test_more_support_less_misfit_and_less_ambiguity_give_more_confidence(
    support: float, more: float, misfit: float, body: float, apart: float
) -> None:
    less = np.tile([1.0, min(support, more), misfit + 1.0, body, apart], (len(LIMBS), 1))
    better = np.tile([1.0, max(support, more), misfit, body, apart / 2], (len(LIMBS), 1))
    assert (limb_confidence(better) >= limb_confidence(less)).all()
    assert ((limb_confidence(less) >= 0.0) & (limb_confidence(better) <= 1.0)).all()


@given(toes=st.floats(-0.2, 0.2), farther=st.floats(0.0, 0.2), against=st.floats(-6.0, 6.0), more=st.floats(0.0, 6.0))
def test_feet_that_reach_farther_forward_and_refuted_rivals_make_the_heading_more_probable(
    toes: float, farther: float, against: float, more: float
) -> None:
    assert 0.0 <= heading_confidence(toes, against) <= heading_confidence(toes + farther) <= 1.0
    assert heading_confidence(toes, against + more) <= heading_confidence(toes, against)
    assert heading_confidence(1.0, 0.0) == pytest.approx(0.5)


def test_running_mean_starts_with_the_first_frame_and_follows() -> None:
    first, then = np.zeros((len(LIMBS), len(FEATURES))), np.ones((len(LIMBS), len(FEATURES)))
    np.testing.assert_array_equal(smoothed_features(None, first), first)
    after = smoothed_features(first, then)
    assert ((after > first) & (after < then)).all()


@pytest.mark.nightly
@pytest.mark.parametrize("limb", range(len(LIMBS)))
def test_limb_that_is_not_where_its_silhouette_is_has_less_confidence_than_the_others(limb: int) -> None:
    evidence = shown(CAMERAS, 3, t_pose_at(3))
    fit = fit_of(setup(CAMERAS), evidence)
    model, pose = model_of(ANATOMY, fit.measured.body), fit.poses[0]
    usual, clear = limb_support(ANATOMY, model, evidence, pose), np.zeros(len(LIMBS))
    right = limb_confidence(limb_features(ANATOMY, model, evidence, pose, usual, 0.8, clear))
    wrong = pose.copy()
    wrong.values[limbs_of(ANATOMY)[limb].ball] += 1.2
    found = limb_confidence(limb_features(ANATOMY, model, evidence, wrong, usual, 0.8, clear))
    assert found[limb] < right[limb]
    assert found[limb] == found[2 * (limb // 2) : 2 * (limb // 2) + 2].min()


def test_limb_is_ambiguous_when_a_pose_with_another_place_of_it_fits_as_well() -> None:
    pose = search_postures(ANATOMY)[0]
    other = pose.copy()
    other.values[limbs_of(ANATOMY)[0].ball] += 0.5
    distances = limb_distances(ANATOMY, average_model(ANATOMY), [pose, other], pose)
    np.testing.assert_allclose(distances[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(distances[1, 1:], 0.0, atol=1e-12)
    assert distances[1, 0] > 0.1
    alike, worse = (ambiguity(distances[1:], np.array([error]), 1e-3) for error in (1e-3, 3e-3))
    np.testing.assert_allclose(alike[0], distances[1, 0] / 2)
    assert 0.0 < worse[0] < 0.01
