"""Refinement by force and moment against plain sums, and its fixed points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import (
    DOF,
    MODEL,
    NO_RAYS,
    apart,
    average_model,
    carried_by,
    contact_of,
    frames_of,
    moved,
    rays_alone,
    tangent_rays,
    upright,
)
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.body.jacobian import ROOT, joint_screws
from zenocap.services.tracker.evidence.evidence import misfit
from zenocap.services.tracker.evidence.rays import nearest_of
from zenocap.services.tracker.evidence.residuals import Weights, robust_weight
from zenocap.services.tracker.filter.closest_points import Correspondence
from zenocap.services.tracker.filter.force import generalized_forces, refine_by_force, rotate_turns
from zenocap.services.tracker.filter.force_printed import refine_as_printed
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.filter.particles import Refinement

FREE = Weights(0.01, 0.15, np.full(DOF, 1.0), 0.25)
seeds = st.integers(0, 10_000)


def refined(kind: Refinement, rays: Floats32, iterations: int, start: RootedPose) -> RootedPose:
    pose = start.copy()
    match kind:
        case "gauss-newton":
            refine(MODEL, rays_alone(rays), FREE, iterations, pose, start)
        case "force":
            refine_by_force(MODEL, rays, FREE, iterations, pose, start)
        case "force-printed":
            refine_as_printed(MODEL, rays, FREE, False, Correspondence(False, False), iterations, pose)
    return pose


def own_screws(model: BodyModel, frames: Floats) -> tuple[Floats, list[int]]:
    """Screws with every turn about the axes of the turning part, and the part that each moves."""
    dof = ROOT + len(model.low)
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    joint_screws(model, frames, screws, owner)
    for part in range(len(frames)):
        if part == 0 or model.kind[part] == 3:
            row = 3 if part == 0 else ROOT + model.first[part]
            screws[row : row + 3] = frames[part, :, :3].T @ screws[row : row + 3]
    return screws, owner.tolist()


def summed(model: BodyModel, pose: RootedPose, rays: Floats32) -> tuple[Floats, Floats]:
    """Gradient (6 + d,) and normal matrix (6 + d, 6 + d) of all rays, each summed along the chain of its part."""
    frames = frames_of(model, pose)
    screws, owner = own_screws(model, frames)
    _, parts = nearest_of(model, frames, rays)
    gradient, matrix = np.zeros(len(screws)), np.zeros((len(screws), len(screws)))
    for i, part in enumerate(parts.tolist()):
        found = contact_of(model, frames[part], part, rays, i)
        weight = FREE.ray_weight * robust_weight(found[0], found[1], FREE.spread, FREE.limit)
        acting = np.isin(owner, carried_by(model, part))
        velocity = screws[:, :3] + np.cross(screws[:, 3:], found[2:5] - pose.position)
        row = np.where(acting, velocity @ found[6:9], 0.0)
        gradient += weight * found[1] * row
        matrix += weight * np.outer(row, row)
    return gradient, matrix


def forces_at(model: BodyModel, pose: RootedPose, rays: Floats32) -> tuple[Floats, Floats]:
    dof = ROOT + len(model.low)
    gradients, bounds = np.empty(dof), np.empty(dof)
    generalized_forces(model, frames_of(model, pose), rays, FREE, gradients, bounds)
    return gradients, bounds


@pytest.mark.nightly
@settings(max_examples=10)
@given(seeds)
def test_generalized_forces_equal_sums_over_each_joints_group(seed: int) -> None:
    """[Hybrid Eq. 38-40]"""
    pose = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(seed), 0.03, 0.1), 100, seed)
    gradient, _ = summed(MODEL, pose, rays)
    assert forces_at(MODEL, pose, rays)[0] == pytest.approx(gradient, abs=1e-6 * np.abs(gradient).max())


@pytest.mark.nightly
@each_anatomy
@settings(max_examples=10)
@given(seed=seeds)
def test_bounds_exceed_the_curvature(anatomy: Anatomy, seed: int) -> None:
    """In every direction, so that steps of gradient over bound always lessen the sum of squares."""
    model, pose = average_model(anatomy), upright(anatomy, seed)
    rays = tangent_rays(model, moved(pose, np.random.default_rng(seed), 0.03, 0.1), 100, seed)
    _, bounds = forces_at(model, pose, rays)
    _, matrix = summed(model, pose, rays)
    assert np.linalg.eigvalsh(np.diag(bounds) - matrix).min() > -1e-6 * bounds.max()


@pytest.mark.slow
def test_force_points_from_model_to_scene() -> None:
    """And moments turn the body towards the scene."""
    pose = upright(seed=4, spread=0.1)
    aside = np.array([0.02, 0.01, -0.015])
    there = pose._replace(position=pose.position + aside)
    gradients, _ = forces_at(MODEL, pose, tangent_rays(MODEL, there, 300, 4))
    assert gradients[:3] @ aside > 0.8 * np.linalg.norm(gradients[:3]) * np.linalg.norm(aside)


def test_turns_convert_to_world_axes_and_back() -> None:
    frames, step = frames_of(MODEL, upright(seed=5)), np.random.default_rng(5).normal(size=DOF)
    world, back = np.empty(DOF), np.empty(DOF)
    rotate_turns(MODEL, frames, step, True, world)
    rotate_turns(MODEL, frames, world, False, back)
    assert back == pytest.approx(step)
    part = FOURTEEN_PARTS.index["right_upper_leg"]
    row = ROOT + int(MODEL.first[part])
    assert world[row : row + 3] == pytest.approx(frames[part, :, :3] @ step[row : row + 3])
    assert world[:3] == pytest.approx(step[:3])


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_force_has_the_fixed_point_of_gauss_newton(seed: int) -> None:
    true = upright(seed=seed, spread=0.2)
    rays = tangent_rays(MODEL, true, 400, seed)
    start = moved(true, np.random.default_rng(seed), 0.02, 0.05)
    newton = refined("gauss-newton", rays, 20, start)
    distances = [apart(MODEL, refined("force", rays, many, start), newton).mean() for many in (0, 20, 400)]
    assert distances[1] < 0.6 * distances[0]
    assert distances[2] < 0.15 * distances[0]


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_printed_force_reduces_the_misfit(seed: int) -> None:
    true = upright(seed=seed, spread=0.2)
    rays = tangent_rays(MODEL, true, 400, seed)
    start = moved(true, np.random.default_rng(seed), 0.03, 0.05)
    after = refined("force-printed", rays, 100, start)
    assert misfit(MODEL, rays_alone(rays), 0.15, after) < 0.5 * misfit(MODEL, rays_alone(rays), 0.15, start)


def test_without_a_scene_there_is_no_printed_force() -> None:
    pose = upright(seed=1, spread=0.1)
    for found, before in zip(refined("force-printed", NO_RAYS, 5, pose), pose, strict=True):
        assert found == pytest.approx(before)


@pytest.mark.nightly
@settings(max_examples=5)
@given(seeds, st.sampled_from(["force", "force-printed"]))
def test_forces_stay_within_the_limits(seed: int, kind: Refinement) -> None:
    """[Hybrid Eq. 41]"""
    start = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(start, np.random.default_rng(seed), 0.1, 0.5), 100, seed)
    found = refined(kind, rays, 20, start)
    assert np.all(found.values >= MODEL.low)
    assert np.all(found.values <= MODEL.high)
    assert found.rotation @ found.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
