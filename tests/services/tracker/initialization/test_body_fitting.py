"""Body fitting: equations against finite differences, recovery of known sizes."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from tests.support.tracker_scenes import NO_RAYS, contact_of, frames_of, in_t_pose, moved, tangent_rays, upright
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.body.jacobian import ROOT, apply_step
from zenocap.services.tracker.body.sizes import COUNT, SPREADS, entries_of, scaled, values_of
from zenocap.services.tracker.evidence.rays import nearest_of
from zenocap.services.tracker.evidence.residuals import robust_weight
from zenocap.services.tracker.initialization.body_fitting import FitSample, fit_body, fit_equations
from zenocap.services.tracker.parameters import FIT_RESIDUAL_LIMIT_M, FIT_RESIDUAL_SCALE_M

pytestmark = pytest.mark.slow


def equations_of(anatomy: Anatomy, body: Bdp, pose: RootedPose, rays: Floats32) -> tuple[Floats, Floats, float, float]:
    """Normal equations in sizes and pose, the sum of squared gaps, and the number of rays."""
    count = COUNT + ROOT + len(pose.values)
    a, b = np.zeros((count, count)), np.zeros(count)
    model, entries, values = model_of(anatomy, body), entries_of(anatomy), values_of(anatomy, body)
    return a, b, *fit_equations(model, entries, values, pose, rays, a, b)


@pytest.mark.nightly
@each_anatomy
def test_equations_equal_finite_differences_in_sizes_and_pose(anatomy: Anatomy) -> None:
    """Ray by ray, by finite differences of the contact; it slides on the surface, which the equations leave out."""
    body, pose = scaled(anatomy, average_body(anatomy, 1.75), np.zeros(COUNT)), upright(anatomy, 1, spread=0.2)
    rays = tangent_rays(model_of(anatomy, body), moved(pose, np.random.default_rng(1), 0.004, 0.01), 60, 1)
    model, dof, tiny = model_of(anatomy, body), ROOT + len(pose.values), 1e-5
    _, parts = nearest_of(model, frames_of(model, pose), rays)
    wrong = []
    for i, part in enumerate(parts.tolist()):
        ray = np.ascontiguousarray(rays[:, i : i + 1])
        found = contact_of(model, frames_of(model, pose)[part], part, ray)
        if abs(found[1]) < 1e-4 or not 0.1 < found[5] < 0.9:
            continue
        a, b, squares, number = equations_of(anatomy, body, pose, ray)
        weight = robust_weight(found[0], found[1], FIT_RESIDUAL_SCALE_M, FIT_RESIDUAL_LIMIT_M)
        row = b / (weight * found[1])
        assert a == pytest.approx(weight * np.outer(row, row), abs=1e-6 * weight)
        assert (squares, number) == (pytest.approx(found[1] ** 2), 1.0)
        plain = np.empty(COUNT + dof)
        for k in range(COUNT + dof):
            gaps = []
            for sign in (1.0, -1.0):
                step, there = sign * tiny * np.eye(COUNT + dof)[k], pose.copy()
                other = model_of(anatomy, scaled(anatomy, body, step[:COUNT]))
                apply_step(model, frames_of(model, pose), step[COUNT:], there)
                gaps.append(contact_of(other, frames_of(other, there)[part], part, ray)[1])
            plain[k] = -(gaps[0] - gaps[1]) / (2 * tiny)
        wrong.append(np.abs(row - plain).max() / np.abs(plain).max())
    assert len(wrong) > 20
    assert np.median(wrong) < 0.05
    assert np.percentile(wrong, 90) < 0.4


def samples_of(anatomy: Anatomy, body: Bdp, many: int) -> list[FitSample]:
    """T-pose and other poses of a body, each started from nearby."""
    model, rng = model_of(anatomy, body), np.random.default_rng(7)
    true = [in_t_pose(anatomy, [0.1, 0.95, 0.0]), *(upright(anatomy, seed, spread=0.3) for seed in range(1, many))]
    return [
        FitSample(tangent_rays(model, pose, 400, n), start, start.values, 0.5)
        for n, pose in enumerate(true)
        for start in [moved(pose, rng, 0.02, 0.05)]
    ]


@pytest.mark.nightly
@each_anatomy
def test_sizes_of_a_body_are_recovered(anatomy: Anatomy) -> None:
    average = average_body(anatomy, 1.75)
    logs = np.random.default_rng(3).normal(scale=0.7 * SPREADS)
    logs[0] = np.log(1.08)
    body = scaled(anatomy, average, logs)
    measured = fit_body(anatomy, average, samples_of(anatomy, body, 4), np.zeros(COUNT), 30)
    assert measured.gap < 0.003
    assert np.abs(measured.body.sizes - body.sizes).max() < 0.008
    assert np.abs(measured.body.offsets - body.offsets).max() < 0.005
    assert np.abs(measured.body.sizes - body.sizes).mean() < 0.003
    assert measured.body.sizes == pytest.approx(scaled(anatomy, average, measured.logs).sizes)


def test_fit_without_rays_keeps_the_average() -> None:
    start = upright()
    sample = FitSample(NO_RAYS, start, start.values, 0.3)
    measured = fit_body(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75), [sample], np.full(COUNT, 0.1), 5)
    assert measured.logs == pytest.approx(np.zeros(COUNT), abs=1e-3)
    assert measured.poses[0].position == pytest.approx(start.position)
