"""Closest points of the printed force; `tests/test_papers.py` has forces and moments."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tracker_scenes import NO_RAYS, average_model, frames_of, upright
from zenocap.common.arrays import Floats
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


def closest_of(frame: Floats, part: int, point: Floats, normal: Floats, flat: bool = False) -> Floats:
    found = np.empty(CLOSEST_LENGTH)
    closest_point(MODEL, frame, part, flat, point, normal, found)
    return found


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
    found = closest_of(frames[part], part, point, normal)
    assert found[0] == pytest.approx(abs(away - radius), abs=1e-6)
    assert found[2] == pytest.approx(normal @ outwards, abs=1e-6)
    assert found[1] == pytest.approx((1 - NORMAL_MODULATION * (normal @ outwards)) * abs(away - radius), abs=1e-6)
    assert found[3:6] == pytest.approx(middle + radius * outwards, abs=1e-6)


@settings(max_examples=40)
@given(seeds)
def test_closest_point_of_a_flat_ended_limb_is_the_nearest_of_side_ends_and_rim(seed: int) -> None:
    """Against the nearest of many points on side and ends, inside and outside of the cylinder."""
    rng = np.random.default_rng(seed)
    frames, part = frames_of(MODEL, upright(TEN_PARTS, seed)), int(rng.choice(LIMBS))
    frame, radius = frames[part], MODEL.radii[part, 0]
    length = MODEL.lengths[part] + radius * MODEL.free[part]
    local = np.array([0.0, 0.5 * length, 0.0]) + rng.normal(size=3) * [radius, 0.5 * length, radius]
    turns, shares = np.linspace(0, 2 * np.pi, 181), np.linspace(0, 1, 101)
    around = np.stack([np.cos(turns), np.zeros(len(turns)), np.sin(turns)], axis=1)
    up = np.array([0.0, length, 0.0])
    side = radius * around[:, None] + shares[:, None] * up
    discs = [radius * shares[:, None] * around[:, None] + end * up for end in (0.0, 1.0)]
    away = min(float(np.linalg.norm(surface - local, axis=2).min()) for surface in (side, *discs))
    point = frame[:, 3] + frame[:, :3] @ (MODEL.bases[part] + local)
    found = closest_of(frame, part, point, frame[:, 1], flat=True)
    assert found[0] == pytest.approx(away, abs=3e-3)
    assert np.linalg.norm(found[3:6] - point) == pytest.approx(found[0], abs=1e-9)
    there = frame[:, :3].T @ (found[3:6] - frame[:, 3]) - MODEL.bases[part]
    across = float(np.hypot(there[0], there[2]))
    assert max(across - radius, -there[1], there[1] - length) == pytest.approx(0.0, abs=1e-9)
    if min(there[1], length - there[1]) > 1e-6:
        assert found[2] == pytest.approx(0.0, abs=1e-6)  # the side's normal is across the axis
    elif across < radius - 1e-6:
        assert abs(found[2]) == pytest.approx(1.0, abs=1e-6)


def test_pose_without_scene_is_unchanged() -> None:
    """There is no force."""
    pose = upright(TEN_PARTS, 1, spread=0.1)
    there = pose.copy()
    refine_as_printed(MODEL, NO_RAYS, FREE, True, Correspondence(True, False), 5, there)
    assert np.array_equal(there.position, pose.position)
    assert there.values == pytest.approx(pose.values)
    assert there.rotation == pytest.approx(pose.rotation)
