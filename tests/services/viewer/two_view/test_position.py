"""Position in one view: known shifts, tilts and turns are recovered.  [Two-view 3.2]"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.limb_cases import UPRIGHT, fit_over
from tests.support.two_view_scene import MODEL, NAVEL, directions, model_mask, rows
from zenocap.common.body.segments import YAW_OFFSETS, torso_rotation
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.position import SHIFTS, estimate_torso, shift_body, turn_scores

LIMBS = directions(right_shoulder_z=140, left_shoulder_z=220)


def pixel_offset(camera: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """From the image of b to that of a, px."""
    local = np.stack([a, b]) @ camera[:3].T + camera[3]
    pixels = camera[4, 0] * local[:, :2] / local[:, 2:]
    return np.asarray(pixels[0] - pixels[1])


def shifted(fit: BodyFit, start: np.ndarray) -> tuple[np.ndarray, float]:
    return shift_body(start, UPRIGHT, LIMBS, MODEL, fit.image, fit.metres_per_pixel(), 1, False)


def test_the_shifts_of_the_paper_are_symmetric() -> None:
    assert sorted(SHIFTS.tolist()) == sorted((-SHIFTS).tolist())
    assert set(SHIFTS.tolist()) == {-5, -2, -1, 1, 2, 5}


@given(st.integers(-7, 7), st.integers(-5, 5), st.sampled_from([0, 1]))
@settings(deadline=None, max_examples=40)  # the first example compiles
def test_a_known_shift_is_found_within_a_pixel(x_px: int, y_px: int, viewer: int) -> None:
    camera, fit = rows(viewer), fit_over(viewer, LIMBS, LIMBS)
    step = fit.metres_per_pixel()
    start = NAVEL + step * (x_px * camera[0] + y_px * camera[1])
    found, score = shifted(fit, start)
    assert np.max(np.abs(pixel_offset(camera, found, NAVEL))) < 1.01
    assert shifted(fit, found)[1] >= score
    assert camera[2] @ found == pytest.approx(camera[2] @ NAVEL), "a shift in the image keeps the depth"


@pytest.mark.parametrize("size", [(160, 120), (640, 480)])
def test_a_shift_is_found_at_either_size(size: tuple[int, int]) -> None:
    camera = rows(0, size)
    fit = BodyFit(MODEL, camera, model_mask(camera, LIMBS, size=size))
    found = estimate_torso(fit, NAVEL + np.array([0.15, -0.08, 0.0]), UPRIGHT, LIMBS)
    assert np.max(np.abs(pixel_offset(camera, found.position, NAVEL))) <= 1.0
    assert found.score > 0.75  # the start is not whole pixels away


def test_another_shift_never_lowers_the_score() -> None:
    fit = BodyFit(MODEL, rows(0), model_mask(rows(1), LIMBS))
    fit.place(NAVEL, UPRIGHT, LIMBS)
    found, score = shifted(fit, NAVEL)
    assert shifted(fit, found)[1] >= score


@pytest.mark.parametrize("viewer", [0, 1])
@pytest.mark.parametrize("tilt_deg", [-12, -7, 0, 7, 12])
def test_a_known_tilt_is_found_with_its_sign(viewer: int, tilt_deg: int) -> None:
    camera, angle = rows(viewer), np.radians(tilt_deg)
    axis = camera[2]  # the view looks along it
    cross = np.cross(axis, np.eye(3)).T  # cross @ v = axis x v
    tilted = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    np.testing.assert_allclose(tilted @ axis, axis, atol=1e-12)
    fit = BodyFit(MODEL, camera, model_mask(camera, LIMBS @ tilted, torso=tilted))
    found = estimate_torso(fit, NAVEL, UPRIGHT, LIMBS)
    assert tilt_deg == 0 or np.sign(found.tilt) == np.sign(tilt_deg)
    assert abs(np.degrees(found.tilt) - tilt_deg) < (5 if tilt_deg else 1.5)


@pytest.mark.parametrize("viewer", [0, 1])
@pytest.mark.parametrize("k", range(len(YAW_OFFSETS)))
def test_a_known_turn_scores_best(viewer: int, k: int) -> None:
    """One arm to the front and one to the side, so that right and left turns differ in the image."""
    camera = rows(viewer)
    pointing = directions(right_shoulder_x=80, left_shoulder_z=270)
    fit = BodyFit(MODEL, camera, model_mask(camera, pointing, torso=torso_rotation(float(YAW_OFFSETS[k]), 0.0, 0.0)))
    scores = turn_scores(NAVEL, UPRIGHT, pointing, MODEL, fit.image, YAW_OFFSETS)
    assert int(np.argmax(scores)) == k
    assert scores[k] == pytest.approx(np.log(1 + 1e-3))


def test_a_torso_estimate_leaves_a_consistent_fit_at_the_found_position() -> None:
    fit = BodyFit(MODEL, rows(0), model_mask(rows(0), LIMBS))
    found = estimate_torso(fit, NAVEL + np.array([0.1, 0.05, 0.0]), UPRIGHT, LIMBS)
    fresh = BodyFit(MODEL, rows(0), fit.image.mask)
    assert fresh.place(found.position, UPRIGHT, LIMBS) == found.score
    np.testing.assert_array_equal(fit.image.cover, fresh.image.cover)
    np.testing.assert_array_equal(fit.image.totals, fresh.image.totals)
    assert len(found.turns) == len(YAW_OFFSETS)
