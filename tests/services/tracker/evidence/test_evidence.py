"""All kinds of evidence are of one type for compiled functions, and each counts by itself."""

import numpy as np
import pytest
from numba import typeof

from tests.support.tracker_ring import ring, shown, t_pose_at
from tests.support.tracker_scenes import DOF, MODEL, frames_of, rays_alone, tangent_rays, upright
from zenocap.services.tracker.evidence.evidence import Evidence, add, misfit, thinned
from zenocap.services.tracker.evidence.field import no_distance_field
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.initialization.localization import detect_t_pose
from zenocap.services.tracker.initialization.t_pose import evidence_near

POSE = upright()._replace(position=np.array([0.0, 0.95, 0.0]))  # near the person, arms elsewhere
WEIGHTS = Weights(0.01, 0.15, np.full(DOF, 1.0), 0.25)
CAMERAS = ring(4)


def added(one: Evidence) -> tuple[np.ndarray, np.ndarray]:
    matrices, gradients = np.empty((len(MODEL.parent), 6, 6)), np.empty((len(MODEL.parent), 6))
    add(MODEL, frames_of(MODEL, POSE), one, WEIGHTS, matrices, gradients)
    return np.tril(matrices), gradients


def test_every_way_to_make_evidence_has_one_compiled_type() -> None:
    whole = shown(CAMERAS, 2, t_pose_at(2))
    ways = (
        thinned(whole, 2), evidence_near(whole, detect_t_pose(whole.rays)), whole._replace(field=no_distance_field()),
        shown(CAMERAS, 2, None),
    )  # fmt: skip
    assert {str(typeof(one)) for one in (*ways, rays_alone(tangent_rays(MODEL, upright(), 20)))} == {str(typeof(whole))}


def test_the_sum_of_all_kinds_is_that_of_each_alone() -> None:
    whole = shown(CAMERAS, 2, t_pose_at(2))
    rays, field = whole._replace(field=no_distance_field()), whole._replace(rays=whole.rays[:, :0].copy())
    for total, *each in zip(added(whole), added(rays), added(field), strict=True):
        assert total == pytest.approx(sum(each), rel=1e-9, abs=1e-9)
        assert np.abs(each[0]).max() > 0.0
    apart = misfit(MODEL, rays, 0.15, POSE) + misfit(MODEL, field, 0.15, POSE)
    assert misfit(MODEL, whole, 0.15, POSE) == pytest.approx(apart, rel=1e-9)
