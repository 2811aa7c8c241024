"""Round limbs of the printed force; `tests/test_papers.py` has closest points, forces and moments."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.tracker_scenes import NO_RAYS, average_model, frames_of, upright
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.tracker.body.jacobian import ROOT
from zenocap.services.tracker.evidence.rays import Weights
from zenocap.services.tracker.filter.closest_points import CLOSEST_LENGTH, Correspondence, closest_point
from zenocap.services.tracker.filter.force_printed import refine_as_printed
from zenocap.services.tracker.parameters import NORMAL_MODULATION

MODEL = average_model(TEN_PARTS)
PARTS = len(TEN_PARTS.parts)
LIMBS = [k for k, part in enumerate(TEN_PARTS.parts) if "arm" in part or "leg" in part]
FREE = Weights(0.01, 0.15, np.full(ROOT + len(MODEL.low), 1.0), 0.25)
seeds = st.integers(0, 10_000)


@given(seeds)
def test_closest_point_of_a_limb_is_a_radius_from_its_axis(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames, part = frames_of(MODEL, upright(TEN_PARTS, seed)), int(rng.choice(LIMBS))
    base, axis, radius = frames[part, :, 3], frames[part, :, 1], MODEL.radii[part, 0]
    point = base + rng.normal(scale=0.3, size=3)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    middle = base + np.clip((point - base) @ axis, 0.0, MODEL.lengths[part]) * axis
    away = float(np.linalg.norm(point - middle))
    outwards = (point - middle) / away
    found = np.empty(CLOSEST_LENGTH)
    closest_point(MODEL, frames[part], part, False, point, normal, found)
    assert found[0] == pytest.approx(abs(away - radius), abs=1e-6)
    assert found[2] == pytest.approx(normal @ outwards, abs=1e-6)
    assert found[1] == pytest.approx((1 - NORMAL_MODULATION * (normal @ outwards)) * abs(away - radius), abs=1e-6)
    assert found[3:6] == pytest.approx(middle + radius * outwards, abs=1e-6)


def test_pose_without_scene_is_unchanged() -> None:
    """There is no force."""
    pose = upright(TEN_PARTS, 1, spread=0.1)
    there = pose.copy()
    refine_as_printed(MODEL, NO_RAYS, FREE, True, Correspondence(True, False), 5, there)
    assert np.array_equal(there.position, pose.position)
    assert there.values == pytest.approx(pose.values)
    assert there.rotation == pytest.approx(pose.rotation)
