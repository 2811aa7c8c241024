"""Search of one limb in the model's own silhouette, for the tests of arms and legs."""

import numpy as np

from tests.support.two_view_scene import MODEL, NAVEL, model_mask, rows
from zenocap.common.arrays import Floats
from zenocap.services.viewer.two_view.body_fit import BodyFit
from zenocap.services.viewer.two_view.limb_search import turn_limb

UPRIGHT = np.eye(3)


def fit_over(viewer: int, truth: Floats, placed: Floats, position: Floats = NAVEL) -> BodyFit:
    """A fit over the silhouette of `truth` (4, 2, 3), with these limbs."""
    fit = BodyFit(MODEL, rows(viewer), model_mask(rows(viewer), truth, position))
    fit.place(position, UPRIGHT, placed)
    return fit


def fit_started_off(viewer: int, truth: Floats, k: int, what: int, off_deg: float) -> BodyFit:
    """A fit over the silhouette of `truth` (4, 2, 3), whose limb k starts `off_deg` away about the view's axis."""
    fit = fit_over(viewer, truth, truth)
    start = truth.copy()
    out = np.empty((2, 3))
    turn_limb(start[k], fit.view_axis, what, np.radians(off_deg), out)
    start[k] = out
    fit.place(NAVEL, UPRIGHT, start)
    return fit


def image_errors_deg(fit: BodyFit, found: Floats, truth: Floats) -> Floats:
    """Angles in degrees between directions (..., 3) in the image."""
    across = np.eye(3) - np.outer(fit.view_axis, fit.view_axis)
    a, b = found @ across, truth @ across
    cosine = np.sum(a * b, axis=-1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def assert_found(fit: BodyFit, k: int, found: Floats, truth: Floats, most_deg: float) -> None:
    """Assert that limb k, found (2, 3), is in the fit and within an angle of that of `truth` (4, 2, 3) in the image."""
    assert np.max(image_errors_deg(fit, found, truth[k])) < most_deg
    np.testing.assert_array_equal(fit.directions[k], found)
    assert_consistent(fit)


def assert_consistent(fit: BodyFit) -> None:
    """Assert that cover and totals equal those of a new fit of the same body."""
    fresh = BodyFit(MODEL, fit.image.camera, fit.image.mask)
    fresh.place(fit.position, fit.torso_to_world, fit.directions)
    np.testing.assert_array_equal(fit.image.cover, fresh.image.cover)
    np.testing.assert_array_equal(fit.image.totals, fresh.image.totals)
