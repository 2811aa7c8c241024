"""Evidence of a frame set: contour rays of the visual hull, silhouette distances.

A kind of evidence is one file: how it is made, its part of the normal equations, and its part of the misfit.  Filter,
search and initialization take all kinds as one argument.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.evidence.field import DistanceField, add_field, distance_field, mean_square_outside
from zenocap.services.tracker.evidence.rays import add_rays, distances_of, mean_truncated_square, nearest_of
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.hull.contour_rays import contour_rays, exclude_views
from zenocap.services.tracker.hull.contours import Contours
from zenocap.services.tracker.hull.views import Silhouettes
from zenocap.services.tracker.parameters import ON_BODY_M, OUTSIDE_WEIGHT


class Evidence(NamedTuple):
    """rays: (11, n), C-contiguous and writable, so that kernels are compiled for one type.  field: of the silhouettes."""

    rays: Floats32
    field: DistanceField


def evidence_of(contours: Contours, silhouettes: Silhouettes, excluded: Collection[int] = ()) -> tuple[Evidence, Floats]:
    """Evidence of the views without some, and the scene points (n, 3) of its rays."""
    contours, silhouettes = exclude_views(contours, silhouettes, excluded)
    found = contour_rays(contours, silhouettes)
    return Evidence(found.rows, distance_field(silhouettes)), found.points


def thinned(evidence: Evidence, step: int) -> Evidence:
    """The evidence with every `step`-th ray."""
    return evidence._replace(rays=np.ascontiguousarray(evidence.rays[:, ::step]))


@kernel
def add(
    model: BodyModel, frames: Floats, evidence: Evidence, weights: Weights, matrices: Floats, gradients: Floats
) -> None:
    """Write every part's wrench matrix (p, 6, 6), lower triangle, and gradient (p, 6) about the root's origin."""
    matrices[:] = 0.0
    gradients[:] = 0.0
    add_rays(model, frames, evidence.rays, weights, matrices, gradients)  # first: the others add
    add_field(model, frames, evidence.field, weights, matrices, gradients)


@kernel
def misfit(model: BodyModel, evidence: Evidence, limit: float, pose: RootedPose) -> float:
    """D of a pose in m^2 [Hybrid Eq. 30], plus the mean square distance of the body outside of the silhouettes."""
    frames = frames_of(model, pose)
    distances, _ = nearest_of(model, frames, evidence.rays)
    # Paper (added): Eq. 30 has no term for the body outside of the silhouettes.
    return float(
        mean_truncated_square(distances, limit) + OUTSIDE_WEIGHT * mean_square_outside(model, frames, evidence.field, limit)
    )


def support_fraction(model: BodyModel, evidence: Evidence, pose: RootedPose) -> float:
    """Fraction of the rays that are on the body."""
    if not evidence.rays.shape[1]:
        return 0.0
    return float(np.mean(distances_of(model, evidence.rays, pose) < ON_BODY_M))
