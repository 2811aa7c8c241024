"""Refinement by force and moment: against plain sums, and how it comes to rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from services.tracker.closest import FOUND, Singles, contact, influence, nearest_parts
from services.tracker.force import forces_on, refine_by_force, turned
from services.tracker.linkage import ROOT, screws_of
from services.tracker.model import Model, model_of
from services.tracker.posed import Posed
from services.tracker.refine import Weights, misfit_of, refine
from services.tracker.refinements import FORCE, FORCE_PRINTED, GAUSS_NEWTON, REFINEMENTS, refine_by
from services.tracker.room import no_room
from services.tracker.stature import average_body
from tests.tracker_scenes import frames_of, moved, positions_of, tangent_rays, upright

MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
DOF = ROOT + len(MODEL.low)
FREE = Weights(0.01, 0.15, np.full(DOF, 1.0), 0.25)
seeds = st.integers(0, 10_000)


def refined(kind: int, model: Model, rays: Singles, iterations: int, start: Posed, weights: Weights = FREE) -> Posed:
    pose = start.copy()
    refine_by(
        kind, model, rays, no_room(), weights, iterations, pose.position, pose.rotation, pose.values,
        start.position, start.rotation, start.values,
    )  # fmt: skip
    return pose


def apart(model: Model, one: Posed, other: Posed) -> float:
    """Metres, the mean over the ends of all parts."""
    return float(np.linalg.norm(positions_of(model, one) - positions_of(model, other), axis=1).mean())


def own_screws(model: Model, frames: Floats) -> tuple[Floats, list[int]]:
    """The screws with every turn about the axes of the part that turns, and the part that each moves."""
    dof = ROOT + len(model.low)
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    screws_of(model, frames, screws, owner)
    for part in range(len(frames)):
        if part == 0 or model.kind[part] == 3:
            row = 3 if part == 0 else ROOT + model.first[part]
            screws[row : row + 3] = frames[part, :, :3].T @ screws[row : row + 3]
    return screws, owner.tolist()


def chain(model: Model, part: int) -> list[int]:
    parts = []
    while part >= 0:
        parts.append(part)
        part = int(model.parent[part])
    return parts


def summed(model: Model, pose: Posed, rays: Singles, weights: Weights) -> tuple[Floats, Floats]:
    """Pull (6 + d,) and normal matrix (6 + d, 6 + d) of all rays, each along the chain of its part."""
    frames = frames_of(model, pose)
    screws, owner = own_screws(model, frames)
    distances, parts = np.empty(rays.shape[1], np.float32), np.empty(rays.shape[1], np.int32)
    nearest_parts(model, frames, rays, distances, parts)
    pull, matrix, found = np.zeros(len(screws)), np.zeros((len(screws), len(screws))), np.empty(FOUND)
    for i, part in enumerate(parts.tolist()):
        contact(model, frames[part], part, rays, i, found)
        weight = weights.share * influence(found, weights.spread, weights.limit)
        acting = np.isin(owner, chain(model, part))
        velocity = screws[:, :3] + np.cross(screws[:, 3:], found[2:5] - pose.position)
        row = np.where(acting, velocity @ found[6:9], 0.0)
        pull += weight * found[1] * row
        matrix += weight * np.outer(row, row)
    return pull, matrix


def forces_at(model: Model, pose: Posed, rays: Singles, weights: Weights) -> tuple[Floats, Floats]:
    dof = ROOT + len(model.low)
    pulls, stiffness = np.empty(dof), np.empty(dof)
    distances, parts = np.empty(rays.shape[1], np.float32), np.empty(rays.shape[1], np.int32)
    forces_on(model, frames_of(model, pose), rays, weights, distances, parts, pulls, stiffness)
    return pulls, stiffness


@settings(max_examples=10)
@given(seeds)
def test_forces_and_moments_are_summed_over_every_joints_group(seed: int) -> None:
    """[Hybrid Eq. 38-40]"""
    pose = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(pose, np.random.default_rng(seed), 0.03, 0.1), 100, seed)
    pull, _ = summed(MODEL, pose, rays, FREE)
    assert forces_at(MODEL, pose, rays, FREE)[0] == pytest.approx(pull, abs=1e-6 * np.abs(pull).max())


@pytest.mark.parametrize("anatomy", [TEN_PARTS, FOURTEEN_PARTS], ids=lambda anatomy: anatomy.name)
@settings(max_examples=10)
@given(seed=seeds)
def test_no_step_is_too_long(anatomy: Anatomy, seed: int) -> None:
    """The stiffness is above the sum of squares in every direction: steps that are forces over it always lessen it."""
    model = model_of(anatomy, average_body(anatomy, 1.75))
    pose = upright(anatomy, seed)
    rays = tangent_rays(model, moved(pose, np.random.default_rng(seed), 0.03, 0.1), 100, seed)
    _, stiffness = forces_at(model, pose, rays, FREE)
    _, matrix = summed(model, pose, rays, FREE)
    assert np.linalg.eigvalsh(np.diag(stiffness) - matrix).min() > -1e-6 * stiffness.max()


def test_a_part_that_is_beside_its_points_is_pulled_to_them() -> None:
    """The force points from the model to the scene, and moments turn the body towards it."""
    pose = upright(seed=4, spread=0.1)
    aside = np.array([0.02, 0.01, -0.015])
    there = Posed(pose.position + aside, pose.rotation, pose.values)
    pulls, _ = forces_at(MODEL, pose, tangent_rays(MODEL, there, 300, 4), FREE)
    assert pulls[:3] @ aside > 0.8 * np.linalg.norm(pulls[:3]) * np.linalg.norm(aside)


def test_turns_go_to_the_world_and_back() -> None:
    frames, step = frames_of(MODEL, upright(seed=5)), np.random.default_rng(5).normal(size=DOF)
    world, back = np.empty(DOF), np.empty(DOF)
    turned(MODEL, frames, step, True, world)
    turned(MODEL, frames, world, False, back)
    assert back == pytest.approx(step)
    part = FOURTEEN_PARTS.index["right_upper_leg"]
    row = ROOT + int(MODEL.first[part])
    assert world[row : row + 3] == pytest.approx(frames[part, :, :3] @ step[row : row + 3])
    assert world[:3] == pytest.approx(step[:3])


@pytest.mark.parametrize("seed", range(4))
def test_a_pose_comes_to_rest_where_gauss_newton_finds_it(seed: int) -> None:
    true = upright(seed=seed, spread=0.2)
    rays = tangent_rays(MODEL, true, 400, seed)
    start = moved(true, np.random.default_rng(seed), 0.02, 0.05)
    newton = refined(GAUSS_NEWTON, MODEL, rays, 20, start)
    distances = [apart(MODEL, refined(FORCE, MODEL, rays, many, start), newton) for many in (0, 20, 400)]
    assert distances[1] < 0.6 * distances[0]
    assert distances[2] < 0.15 * distances[0]


@pytest.mark.parametrize("seed", range(4))
def test_as_printed_a_pose_comes_nearer(seed: int) -> None:
    true = upright(seed=seed, spread=0.2)
    rays = tangent_rays(MODEL, true, 400, seed)
    start = moved(true, np.random.default_rng(seed), 0.03, 0.05)
    found = refined(FORCE_PRINTED, MODEL, rays, 100, start)

    def misfit(pose: Posed) -> float:
        return float(misfit_of(MODEL, rays, no_room(), 0.15, pose.position, pose.rotation, pose.values))

    assert misfit(found) < 0.5 * misfit(start)


@settings(max_examples=5)
@given(seeds, st.sampled_from([FORCE, FORCE_PRINTED]))
def test_no_force_leaves_the_limits(seed: int, kind: int) -> None:
    """[Hybrid Eq. 41]"""
    start = upright(seed=seed)
    rays = tangent_rays(MODEL, moved(start, np.random.default_rng(seed), 0.1, 0.5), 100, seed)
    found = refined(kind, MODEL, rays, 20, start)
    assert np.all(found.values >= MODEL.low)
    assert np.all(found.values <= MODEL.high)
    assert found.rotation @ found.rotation.T == pytest.approx(np.eye(3), abs=1e-9)


def test_each_refinement_is_chosen_by_its_number() -> None:
    start = upright(seed=7)
    rays = tangent_rays(MODEL, moved(start, np.random.default_rng(7), 0.02, 0.1), 100, 7)
    by_newton, by_force = start.copy(), start.copy()
    refine(
        MODEL, rays, no_room(), FREE, 3, by_newton.position, by_newton.rotation, by_newton.values,
        start.position, start.rotation, start.values,
    )  # fmt: skip
    refine_by_force(
        MODEL, rays, FREE, 3, by_force.position, by_force.rotation, by_force.values,
        start.position, start.rotation, start.values,
    )  # fmt: skip
    for name, pose in (("gauss-newton", by_newton), ("force", by_force)):
        chosen = refined(REFINEMENTS.index(name), MODEL, rays, 3, start)
        assert np.array_equal(chosen.values, pose.values)
    assert [REFINEMENTS[k] for k in (GAUSS_NEWTON, FORCE, FORCE_PRINTED)] == ["gauss-newton", "force", "force-printed"]
