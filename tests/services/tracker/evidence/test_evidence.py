"""All kinds of evidence are of one type for compiled functions, and each counts by itself."""

import numpy as np
import pytest
from numba import typeof

from tests.support.tracker_ring import rendered_masks, ring, seen, t_pose_at
from tests.support.tracker_scenes import rays_alone, tangent_rays, upright
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import frames_of, model_of
from zenocap.services.tracker.evidence.evidence import Evidence, add, misfit, thinned
from zenocap.services.tracker.evidence.field import no_distance_field
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.initialization.localization import TPose, detect_t_pose
from zenocap.services.tracker.initialization.t_pose import evidence_near

MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
POSE = upright()._replace(position=np.array([0.0, 0.95, 0.0]))  # near the person, arms elsewhere
WEIGHTS = Weights(0.01, 0.15, np.full(6 + len(MODEL.low), 1.0), 0.25)
CAMERAS = ring(4)


def evidence() -> Evidence:
    return seen(CAMERAS, list(rendered_masks(CAMERAS, 2, t_pose_at(2)).values()))


def added(one: Evidence) -> tuple[np.ndarray, np.ndarray]:
    matrices, gradients = np.empty((len(MODEL.parent), 6, 6)), np.empty((len(MODEL.parent), 6))
    add(MODEL, frames_of(MODEL, POSE), one, WEIGHTS, matrices, gradients)
    return np.tril(matrices), gradients


def test_every_way_to_make_evidence_has_one_compiled_type() -> None:
    whole = evidence()
    t_pose = detect_t_pose(whole.rays)
    assert isinstance(t_pose, TPose)
    nothing = seen(CAMERAS, [np.zeros(camera.size[::-1], np.uint8) for camera in CAMERAS.values()])
    ways = (thinned(whole, 2), evidence_near(whole, t_pose), whole._replace(field=no_distance_field()), nothing)
    assert {str(typeof(one)) for one in (*ways, rays_alone(tangent_rays(MODEL, upright(), 20)))} == {str(typeof(whole))}


def test_the_sum_of_all_kinds_is_that_of_each_alone() -> None:
    whole = evidence()
    rays, field = whole._replace(field=no_distance_field()), whole._replace(rays=whole.rays[:, :0].copy())
    for total, *each in zip(added(whole), added(rays), added(field), strict=True):
        assert total == pytest.approx(sum(each), rel=1e-9, abs=1e-9)
        assert np.abs(each[0]).max() > 0.0
    apart = misfit(MODEL, rays, 0.15, POSE) + misfit(MODEL, field, 0.15, POSE)
    assert misfit(MODEL, whole, 0.15, POSE) == pytest.approx(apart, rel=1e-9)
