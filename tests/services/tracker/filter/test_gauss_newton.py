"""Gauss-Newton refinement: equations against plain least squares, recovery of known poses."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import (
    DOF,
    MODEL,
    NO_RAYS,
    Touch,
    apart,
    average_model,
    frames_of,
    moved,
    rays_alone,
    tangent_rays,
    touch,
    upright,
)
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import Anatomy
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.body.jacobian import ROOT, apply_step
from zenocap.services.tracker.evidence.evidence import misfit
from zenocap.services.tracker.evidence.rays import distances_of
from zenocap.services.tracker.evidence.residuals import Weights, robust_weight
from zenocap.services.tracker.filter.gauss_newton import refine

FREE = Weights(0.01, 0.15, np.full(DOF, 0.01), 0.25)


def refined(
    model: BodyModel, rays: Floats32, weights: Weights, iterations: int, start: RootedPose, target: RootedPose
) -> RootedPose:
    pose = start.copy()
    refine(model, rays_alone(rays), weights, iterations, pose, target)
    return pose


def nearest(frames: Floats, ray: Floats) -> tuple[int, Touch]:
    every = [touch(MODEL, frames[part], part, ray) for part in range(len(MODEL.parent))]
    part = int(np.argmin([one.distance for one in every]))
    return part, every[part]


def rows_of(pose: RootedPose, rays: Floats32, weights: Weights) -> tuple[Floats, Floats]:
    """Residuals (n,) and how they shrink with every degree of freedom (n, DOF), both times the root of the weight.

    The motion of a contact is by finite differences of `apply_step` and `place`.
    """
    frames, tiny = frames_of(MODEL, pose), 1e-6
    steps = []
    for k in range(DOF):
        there = pose.copy()
        apply_step(MODEL, frames, tiny * np.eye(DOF)[k], there)
        steps.append((frames_of(MODEL, there) - frames) / tiny)
    residuals, jacobian = [], []
    for ray in rays.T.astype(np.float64):
        part, one = nearest(frames, ray)
        root = np.sqrt(weights.ray_weight * robust_weight(one.distance, one.gap, weights.spread, weights.limit))
        local = frames[part, :, :3].T @ (one.point - frames[part, :, 3])
        residuals.append(root * one.gap)
        jacobian.append([root * float(one.shrinks @ (step[part, :, :3] @ local + step[part, :, 3])) for step in steps])
    return np.array(residuals), np.array(jacobian)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(3))
def test_one_iteration_is_the_least_squares_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = upright(seed=seed, spread=0.2)
    rays = tangent_rays(MODEL, moved(start, rng, 0.005, 0.02), 200, seed)
    weights = FREE._replace(precision=rng.uniform(1.0, 50.0, DOF))
    weights.precision[3:6] = weights.precision[3]
    residuals, jacobian = rows_of(start, rays, weights)
    held = np.diag(np.sqrt(weights.precision + 1e-6))
    step, *_ = np.linalg.lstsq(np.vstack([jacobian, held]), np.concatenate([residuals, np.zeros(DOF)]), rcond=None)
    expected = start.copy()
    apply_step(MODEL, frames_of(MODEL, start), step, expected)
    found = refined(MODEL, rays, weights, 1, start, start)
    assert found.position == pytest.approx(expected.position, abs=1e-5)
    assert found.rotation == pytest.approx(expected.rotation, abs=1e-5)
    assert found.values == pytest.approx(expected.values, abs=1e-4)


@pytest.mark.nightly
@each_anatomy
@pytest.mark.parametrize("seed", range(4))
def test_perturbed_pose_is_recovered(anatomy: Anatomy, seed: int) -> None:
    model, true = average_model(anatomy), upright(anatomy, seed, spread=0.3)
    rays = tangent_rays(model, true, 400, seed)
    start = moved(true, np.random.default_rng(seed), 0.02, 0.06)
    weights = FREE._replace(precision=np.full(ROOT + len(model.low), 0.01))
    found = refined(model, rays, weights, 20, start, start)
    away = apart(model, found, true)
    assert apart(model, start, true).mean() > 0.02
    assert away.mean() < 0.001
    assert np.percentile(away, 90) < 0.002
    assert away.max() < 0.004  # rays at a joint may be assigned to its other part


def test_pose_without_scene_moves_to_its_target() -> None:
    start, target = upright(seed=1, spread=0.2), upright(seed=2, spread=0.2)
    found = refined(MODEL, NO_RAYS, FREE._replace(precision=np.full(DOF, 1e3)), 30, start, target)
    assert apart(MODEL, found, target).max() < 1e-4


@pytest.mark.slow
def test_high_precision_keeps_the_target() -> None:
    start = upright(seed=1)
    rays = tangent_rays(MODEL, moved(start, np.random.default_rng(1), 0.03, 0.1), 200, 1)
    found = refined(MODEL, rays, FREE._replace(precision=np.full(DOF, 1e12)), 4, start, start)
    assert apart(MODEL, found, start).max() < 1e-4


@pytest.mark.slow
def test_misfit_of_a_pose_is_that_of_its_distances() -> None:
    """[Hybrid Eq. 30]"""
    pose = upright(seed=3)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(3), 0.05, 0.2), 60, 3)
    plain = np.array([nearest(frames_of(MODEL, pose), ray)[1].distance for ray in rays.T.astype(np.float64)])
    distances = distances_of(MODEL, rays, pose)
    assert distances == pytest.approx(plain, abs=2e-3)
    expected = np.mean(np.minimum(plain, 0.15) ** 2)
    assert misfit(MODEL, rays_alone(rays), 0.15, pose) == pytest.approx(expected, rel=0.01)
