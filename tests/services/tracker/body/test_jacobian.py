"""Jacobian of the body against finite differences and dense sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import DOF, MODEL, PARTS, average_model, carried_by, frames_of, upright
from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.body.jacobian import ROOT, add_target_gradient, apply_step, joint_screws, normal_equations

pytestmark = pytest.mark.slow

seeds = st.integers(0, 10_000)


def stepped(model: BodyModel, pose: RootedPose, step: Floats) -> RootedPose:
    there = pose.copy()
    apply_step(model, frames_of(model, pose), step, there)
    return there


def screws_at(model: BodyModel, pose: RootedPose) -> tuple[Floats, Ints]:
    dof = ROOT + len(model.low)
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    joint_screws(model, frames_of(model, pose), screws, owner)
    return screws, owner


@each_anatomy
@pytest.mark.parametrize("seed", range(3))
def test_screws_equal_finite_differences(anatomy: Anatomy, seed: int) -> None:
    """Every point of every part, by finite differences of `apply_step` and `forward_kinematics`."""
    model, pose, tiny = average_model(anatomy), upright(anatomy, seed), 1e-6
    screws, owner = screws_at(model, pose)
    local = np.array([0.05, 0.2, -0.03])
    before = frames_of(model, pose)[:, :, :3] @ local + frames_of(model, pose)[:, :, 3]
    for k in range(len(screws)):
        there, back = (frames_of(model, stepped(model, pose, sign * tiny * np.eye(len(screws))[k])) for sign in (1, -1))
        moving = ((there - back)[:, :, :3] @ local + (there - back)[:, :, 3]) / (2 * tiny)
        for part in range(len(model.parent)):
            velocity = screws[k, :3] + np.cross(screws[k, 3:], before[part] - pose.position)
            expected = velocity if owner[k] in carried_by(model, part) else np.zeros(3)
            assert moving[part] == pytest.approx(expected, abs=1e-6)


@settings(max_examples=10)
@given(seeds)
def test_normal_equations_equal_dense_sums(seed: int) -> None:
    rng = np.random.default_rng(seed)
    screws, owner = screws_at(MODEL, upright(seed=seed))
    roots = rng.normal(size=(PARTS, 6, 6))
    matrices, gradients = roots @ roots.transpose(0, 2, 1), rng.normal(size=(PARTS, 6))
    expected_a, expected_b = np.zeros((DOF, DOF)), np.zeros(DOF)
    for part in range(PARTS):
        jacobian = np.where(np.isin(owner, carried_by(MODEL, part))[:, None], screws, 0.0)
        expected_a += jacobian @ matrices[part] @ jacobian.T
        expected_b += jacobian @ gradients[part]
    a, b = np.empty((DOF, DOF)), np.empty(DOF)
    normal_equations(MODEL, screws, owner, np.tril(matrices), gradients, a, b)
    assert np.tril(a) == pytest.approx(np.tril(expected_a), abs=1e-9)
    assert b == pytest.approx(expected_b, abs=1e-9)


@settings(max_examples=20)
@given(seeds)
def test_target_gradient_is_the_precision_times_the_step_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = upright(seed=seed, spread=0.2)
    step = rng.normal(scale=0.05, size=DOF)
    target = stepped(MODEL, pose, step)
    precision, gradient = rng.uniform(1, 10, DOF), np.ones(DOF)
    add_target_gradient(MODEL, frames_of(MODEL, pose), pose, target, precision, gradient)
    assert np.all((target.values > MODEL.low) & (target.values < MODEL.high))
    assert gradient == pytest.approx(1.0 + precision * step, abs=1e-8)


@settings(max_examples=20)
@given(seeds, st.floats(0.0, 5.0))
def test_steps_stay_within_the_limits(seed: int, length: float) -> None:
    """[Hybrid Eq. 41]"""
    rng = np.random.default_rng(seed)
    there = stepped(MODEL, upright(seed=seed), rng.normal(scale=length, size=DOF))
    assert np.all(there.values >= MODEL.low)
    assert np.all(there.values <= MODEL.high)
    assert there.rotation @ there.rotation.T == pytest.approx(np.eye(3), abs=1e-9)


def test_root_step_is_in_world_axes() -> None:
    pose = upright(seed=2)
    step = np.zeros(DOF)
    step[:6] = [0.1, -0.2, 0.3, 0.0, np.pi / 2, 0.0]
    there = stepped(MODEL, pose, step)
    assert there.position - pose.position == pytest.approx([0.1, -0.2, 0.3])
    quarter = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert there.rotation == pytest.approx(quarter @ pose.rotation)
    assert there.values == pytest.approx(pose.values)
