"""Scene of the two-view tests: a body, poses within its limits, level cameras, model silhouettes."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Floats, Mask
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import limb_directions
from zenocap.common.camera.level_view import level_view
from zenocap.services.viewer.two_view.body_fit import BodyFit, body_model, camera_rows
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp

SMALL = (160, 120)
NAVEL = np.array([0.0, 0.95, 0.0])
BDP = true_bdp(person(7))
MODEL = body_model(TEN_PARTS, BDP)

SHARES = arrays(np.float64, len(TEN_PARTS.angles), elements=st.floats(0.0, 1.0))


def within_limits(shares: Floats) -> Floats:
    """Joint angles (22,) at the given fractions, 0 to 1, of their ranges."""
    low, high = TEN_PARTS.limits.T
    return low + shares * (high - low)


ANGLES = SHARES.map(within_limits)


def rows(viewer: int, size: tuple[int, int] = SMALL) -> Floats:
    """(5, 3) of the paper's camera 0 (on +Z) or 1 (on -X)."""
    return camera_rows(level_view(paper_cameras(size)[viewer]).camera)


def angles(**named: float) -> Floats:
    """The neutral pose's angles with some others in degrees: right_shoulder_z=90."""
    pose = TEN_PARTS.neutral.copy()
    for name, degrees in named.items():
        joint, axis = name.rsplit("_", 1)
        pose[TEN_PARTS.index[f"{joint}.{axis}"]] = np.radians(degrees)
    return pose


def directions(**named: float) -> Floats:
    return limb_directions(TEN_PARTS, angles(**named))


def model_mask(
    camera: Floats, limbs: Floats, position: Floats = NAVEL, torso: Floats | None = None, size: tuple[int, int] = SMALL
) -> Mask:
    """The model's own silhouette, as of a perfect match."""
    fit = BodyFit(MODEL, camera, np.zeros((size[1], size[0]), np.uint8))
    fit.place(position, np.eye(3) if torso is None else torso, limbs)
    return np.ascontiguousarray((fit.image.cover > 0).astype(np.uint8))


def degrees_between(a: Floats, b: Floats) -> Floats:
    """Angles in degrees between unit vectors (..., 3)."""
    return np.degrees(np.arccos(np.clip(np.sum(a * b, axis=-1), -1.0, 1.0)))
