"""Distance outside of silhouettes, and its gradient."""

import numpy as np
import pytest

from tests.support.tracker_scenes import DOF, MODEL, NO_RAYS, upright
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.evidence.evidence import Evidence, misfit
from zenocap.services.tracker.evidence.field import DistanceField, distance_field, no_distance_field, outside_at
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.hull.contour_rays import extract_outlines

FOCAL, AWAY, RADIUS_PX = 600.0, 4.0, 60
MATRIX = np.array([[FOCAL, 0.0, 319.5], [0.0, FOCAL, 239.5], [0.0, 0.0, 1.0]])
CAMERA = Camera("1", (640, 480), MATRIX, np.zeros(4), np.diag([1.0, -1.0, -1.0]), np.array([0.0, 1.0, AWAY]))


def disc_distance_field() -> DistanceField:
    """One view, on +Z, of a disc around (0, 1, 0)."""
    row, column = np.mgrid[:480, :640]
    disc = ((column - 319.5) ** 2 + (row - 239.5) ** 2 < RADIUS_PX**2).astype(np.uint8)
    return distance_field(extract_outlines([disc], [CAMERA], 100)[1])


@pytest.mark.parametrize("turn", np.linspace(0.0, 6.0, 7))
@pytest.mark.parametrize("beyond_m", [0.05, 0.1, 0.5, 1.2])  # the last two are outside of the map
def test_distance_outside_equals_the_projected_distance(turn: float, beyond_m: float) -> None:
    across = np.array([np.cos(turn), np.sin(turn), 0.0])
    place = np.array([0.0, 1.0, 0.0]) + (RADIUS_PX * AWAY / FOCAL + beyond_m) * across
    found = np.zeros(4)
    assert outside_at(disc_distance_field(), 0, *place, found)
    assert found[0] == pytest.approx(beyond_m, abs=0.04 + 0.05 * beyond_m)  # a coarse map, dilated by a pixel
    ray = (place - CAMERA.centre) / np.linalg.norm(place - CAMERA.centre)
    inward = -across + (across @ ray) * ray  # no change along the ray
    assert found[1:] @ inward > 0.9 * np.linalg.norm(inward)  # of a coarse disc
    assert np.linalg.norm(found[1:]) == pytest.approx(1.0)


def test_points_inside_or_out_of_view_are_not_outside() -> None:
    field, found = disc_distance_field(), np.zeros(4)
    for place in ((0.0, 1.0, 0.0), (0.2, 1.1, 0.0), (0.0, 1.0, AWAY + 1.0), (3.0, 1.0, 0.0)):
        assert not outside_at(field, 0, *place, found)


def test_body_outside_a_silhouette_is_refined_towards_it() -> None:
    """Without rays, by the distance field only."""
    pose = upright()
    pose.position[0] = 1.0
    weights = Weights(0.01, 3.0, np.full(DOF, 1.0), 0.25)
    evidence = Evidence(NO_RAYS, disc_distance_field())
    before = misfit(MODEL, evidence, 3.0, pose)
    assert before > 0.05
    assert misfit(MODEL, Evidence(NO_RAYS, no_distance_field()), 3.0, pose) == 0.0
    refine(MODEL, evidence, weights, 10, pose, pose.copy())
    assert misfit(MODEL, evidence, 3.0, pose) < 0.8 * before
