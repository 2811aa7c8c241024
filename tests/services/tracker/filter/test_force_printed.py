"""Force and moment as printed: closest points, forces and sums against a plain oracle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.tracker_scenes import NO_RAYS, average_model, carried_by, frames_of, moved, tangent_rays, upright
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.tracker.body.jacobian import ROOT
from zenocap.services.tracker.evidence.rays import Weights
from zenocap.services.tracker.filter.closest_points import CLOSEST_LENGTH, Correspondence, closest_point
from zenocap.services.tracker.filter.force_printed import group_forces, refine_as_printed
from zenocap.services.tracker.hull.contour_rays import midpoints
from zenocap.services.tracker.parameters import FORCE_TRUNCATION_M, NORMAL_MODULATION

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


def clear(frames: Floats, rays: Floats32, flat: bool) -> list[bool]:
    """Whether each scene point has one closest part: two limbs that meet in a joint may be equally close."""
    found = []
    for point, normal in zip(midpoints(rays), rays[6:9].T.astype(np.float64), strict=True):
        every = np.array([closest_of(frames[part], part, point, normal, flat)[:2] for part in range(PARTS)])
        first, second = np.sort(every, axis=0)[:2]
        found.append(bool(np.all(second - first > 1e-5)))
    return found


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("linear", "closest", "flat"), [(True, False, False), (False, True, True)], ids=["linear", "paper"]
)
@settings(max_examples=5)
@given(seed=seeds)
def test_forces_and_moments_are_summed_over_groups(linear: bool, closest: bool, flat: bool, seed: int) -> None:
    """[Hybrid Eq. 32, 33, 38-40], with the direction of Fig. 2."""
    pose = upright(TEN_PARTS, seed)
    frames = frames_of(MODEL, pose)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(seed), 0.05, 0.2), 80, seed)
    rays = np.ascontiguousarray(rays[:, clear(frames, rays, flat)])
    forces, moments, numbers = np.zeros((PARTS, 3)), np.zeros((PARTS, 3)), np.zeros(PARTS)
    for point, normal in zip(midpoints(rays), rays[6:9].T.astype(np.float64), strict=True):
        every = [closest_of(frames[part], part, point, normal, flat) for part in range(PARTS)]
        part = int(np.argmin([one[0 if closest else 1] for one in every]))
        distance, cosine, on_model = every[part][0], every[part][2], every[part][3:6]
        if distance >= 0.15:
            continue
        rho = min(max(cosine, 0.0) * distance, FORCE_TRUNCATION_M) ** (1 if linear else 2)
        force = rho * (point - on_model) / np.linalg.norm(point - on_model)
        for carrier in carried_by(MODEL, part):
            forces[carrier] += force
            moments[carrier] += np.cross(on_model - frames[carrier, :, 3], force)
            numbers[carrier] += 1
    found = np.empty((PARTS, 3)), np.empty((PARTS, 3)), np.empty(PARTS)
    parts = np.random.default_rng(2).integers(0, PARTS, rays.shape[1])
    group_forces(MODEL, frames, rays, 0.15, linear, Correspondence(closest, flat), parts, *found)
    assert found[0] == pytest.approx(forces, abs=1e-6)
    assert found[1] == pytest.approx(moments, abs=1e-6)
    assert np.array_equal(found[2], numbers)


def test_pose_without_scene_is_unchanged() -> None:
    """There is no force."""
    pose = upright(TEN_PARTS, 1, spread=0.1)
    there = pose.copy()
    refine_as_printed(MODEL, NO_RAYS, FREE, True, Correspondence(True, False), 5, there)
    assert np.array_equal(there.position, pose.position)
    assert there.values == pytest.approx(pose.values)
    assert there.rotation == pytest.approx(pose.rotation)
