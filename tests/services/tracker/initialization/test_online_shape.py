"""Online shape estimation: information of postures against one joint solve with all poses free."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.tracker_scenes import DOF, moved, tangent_rays, upright
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.body.sizes import COUNT, SPREADS, entries_of, scaled, values_of
from zenocap.services.tracker.initialization.body_fitting import fit_equations
from zenocap.services.tracker.initialization.online_shape import (
    ShapeEstimate,
    improved_body,
    initial_shape,
    is_new_posture,
    updated_shape,
)
from zenocap.services.tracker.parameters import MAX_POSTURES, NEW_POSTURE_ANGLE, POSTURE_DEVIATION, SHAPE_CHANGE

ANATOMY = FOURTEEN_PARTS
AVERAGE = average_body(ANATOMY, 1.75)
LOGS = np.random.default_rng(3).normal(scale=0.3 * SPREADS)
BODY = scaled(ANATOMY, AVERAGE, LOGS)
EFFECTIVE = 80.0


def postures(body: Bdp, many: int) -> list[tuple[RootedPose, Floats32]]:
    """Poses of a body of these sizes, and their scenes."""
    model = model_of(ANATOMY, body)
    poses = [upright(ANATOMY, seed, spread=0.6) for seed in range(many)]
    rng = np.random.default_rng(1)
    return [(moved(pose, rng, 0.003, 0.01), tangent_rays(model, pose, 300, n)) for n, pose in enumerate(poses)]


def normal(shape: ShapeEstimate, pose: RootedPose, rays: Floats32) -> tuple[Floats, Floats]:
    """Normal equations of one posture in sizes and pose, prior of the pose included."""
    body = scaled(ANATOMY, shape.average, shape.logs)
    a, b = np.zeros((COUNT + DOF, COUNT + DOF)), np.zeros(COUNT + DOF)
    fit_equations(model_of(ANATOMY, body), entries_of(ANATOMY), values_of(ANATOMY, body), pose, rays, a, b)
    a, b = a * EFFECTIVE / rays.shape[1], b * EFFECTIVE / rays.shape[1]
    a[COUNT:, COUNT:] += np.diag(1.0 / np.repeat(POSTURE_DEVIATION, [3, 3, DOF - 6]) ** 2)
    return a, b


@pytest.mark.nightly
def test_sequential_postures_equal_one_joint_solve() -> None:
    """Schur complements: marginalizing each pose on arrival changes nothing."""
    seen = postures(BODY, 3)
    shape = initial_shape(AVERAGE, 0.5 * LOGS)
    for pose, rays in seen:
        shape = updated_shape(ANATOMY, shape, rays, pose, EFFECTIVE)
    whole, gradient = np.zeros((COUNT + 3 * DOF, COUNT + 3 * DOF)), np.zeros(COUNT + 3 * DOF)
    whole[:COUNT, :COUNT] = np.diag(1.0 / SPREADS**2)
    gradient[:COUNT] = -shape.logs / SPREADS**2  # towards the average, from the body in use
    for n, (pose, rays) in enumerate(seen):
        a, b = normal(shape, pose, rays)
        rows = np.r_[0:COUNT, COUNT + n * DOF : COUNT + (n + 1) * DOF]
        whole[np.ix_(rows, rows)] += a
        gradient[rows] += b
    step = np.linalg.solve(whole, gradient)[:COUNT]
    assert np.linalg.solve(shape.information, shape.gradient) == pytest.approx(shape.logs + step, abs=1e-7)
    certain = np.linalg.inv(whole)[:COUNT, :COUNT]
    assert np.linalg.inv(shape.information) == pytest.approx(certain, abs=1e-9)


@pytest.mark.nightly
def test_every_posture_adds_information() -> None:
    shape = initial_shape(AVERAGE)
    for pose, rays in postures(BODY, 4):
        more = updated_shape(ANATOMY, shape, rays, pose)
        assert np.linalg.eigvalsh(more.information - shape.information).min() > -1e-6
        shape = more
    spread = np.sqrt(np.diag(np.linalg.inv(shape.information)))
    assert np.all(spread <= SPREADS * (1 + 1e-9))
    assert spread[0] < 0.2 * SPREADS[0]
    assert np.array_equal(shape.logs, np.zeros(COUNT))


@pytest.mark.nightly
def test_sizes_converge_to_the_persons() -> None:
    shape = initial_shape(AVERAGE)
    for pose, rays in postures(BODY, 8):
        shape = updated_shape(ANATOMY, shape, rays, pose)
    known, body = improved_body(ANATOMY, shape)
    assert np.array_equal(body.sizes, scaled(ANATOMY, AVERAGE, known.logs).sizes)
    before, after = np.abs(AVERAGE.offsets - BODY.offsets).sum(), np.abs(body.offsets - BODY.offsets).sum()
    assert after < 0.6 * before


@pytest.mark.slow
def test_body_is_unchanged_without_new_information() -> None:
    shape = initial_shape(AVERAGE)
    assert improved_body(ANATOMY, shape) is None
    pose, rays = postures(AVERAGE, 1)[0]
    true = upright(ANATOMY, 0, spread=0.6)
    shape = updated_shape(ANATOMY, shape, rays, true)
    assert improved_body(ANATOMY, shape) is None  # equal to the assumed one
    assert not is_new_posture(shape, true)
    assert not is_new_posture(shape, pose)


def test_posture_is_new_when_one_joint_differs_from_all_used() -> None:
    pose = upright(ANATOMY, 0)
    shape = replace(initial_shape(AVERAGE, LOGS), postures=(pose.values,))
    assert is_new_posture(initial_shape(AVERAGE, LOGS), pose)
    for by, new in ((0.9 * NEW_POSTURE_ANGLE, False), (1.1 * NEW_POSTURE_ANGLE, True)):
        there = pose.copy()
        there.values[4] += by
        assert is_new_posture(shape, there) is new
    full = replace(shape, postures=(pose.values,) * MAX_POSTURES)
    assert not is_new_posture(full, upright(ANATOMY, 5, spread=1.0))


def test_small_change_keeps_the_body() -> None:
    shape = initial_shape(AVERAGE)
    for size, changes in ((0.5 * SHAPE_CHANGE, False), (2.0 * SHAPE_CHANGE, True)):
        pulled = replace(shape, gradient=shape.information @ np.full(COUNT, size))
        assert (improved_body(ANATOMY, pulled) is not None) is changes
