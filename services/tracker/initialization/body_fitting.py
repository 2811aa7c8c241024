"""Joint fit of a body's sizes and its poses to scenes of one person."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Bools, Floats, Floats32, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp
from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of, model_of
from zenocap.services.tracker.body.jacobian import ROOT, add_target_gradient, apply_step, joint_screws
from zenocap.services.tracker.body.sizes import (
    BASES,
    COUNT,
    LENGTH,
    OFFSETS,
    SIZES,
    SPREADS,
    TIPS,
    entries_of,
    scaled,
    values_of,
)
from zenocap.services.tracker.evidence.rays import CONTACT_LENGTH, contact_on_part, nearest_of
from zenocap.services.tracker.evidence.residuals import robust_weight
from zenocap.services.tracker.filter.cholesky import cholesky_solve
from zenocap.services.tracker.parameters import (
    FIT_GAP_TRUNCATION_M,
    FIT_INDEPENDENT_RAYS,
    FIT_MAX_STEP,
    FIT_RESIDUAL_LIMIT_M,
    FIT_RESIDUAL_SCALE_M,
    FIT_TOLERANCE,
    SIZE_LIMIT,
)


@dataclass(frozen=True)
class FitSample:
    """One scene of a fit: rays (11, n) and initial pose.

    held: (d,) coordinates about which the pose is held, with a standard deviation `looseness`, radians.
    """

    rays: Floats32
    pose: RootedPose
    held: Floats
    looseness: float


@dataclass(frozen=True)
class FittedBody:
    """Result of a fit.  logs: (COUNT,) see `scaled`.  poses: of the samples.  gap: root mean square, metres."""

    body: Bdp
    logs: Floats
    poses: tuple[RootedPose, ...]
    gap: float


def fit_body(
    anatomy: Anatomy,
    average: Bdp,
    samples: Sequence[FitSample],
    logs: Floats,
    iterations: int,
    effective: float = FIT_INDEPENDENT_RAYS,
) -> FittedBody:
    """Body that fits the samples best, from an average one and initial logs (COUNT,).

    Gauss-Newton on the gaps of all rays, over the sizes' factors and every sample's pose.  effective: independent rays of
    a sample; the fewer, the closer the body stays to the average one.
    """
    dof = ROOT + coordinates_of(anatomy).dimension
    entries = entries_of(anatomy)
    poses = [sample.pose.copy() for sample in samples]
    count = COUNT + dof * len(samples)
    logs, gap = logs.copy(), np.inf
    for _ in range(iterations):
        a, b = np.zeros((count, count)), np.zeros(count)
        a[np.arange(COUNT), np.arange(COUNT)] = 1.0 / SPREADS**2
        b[:COUNT] = -logs / SPREADS**2
        body = scaled(anatomy, average, logs)
        model, values = model_of(anatomy, body), values_of(anatomy, body)
        total = number = 0.0
        for k, (sample, pose) in enumerate(zip(samples, poses, strict=True)):
            own, gradient = np.zeros((COUNT + dof, COUNT + dof)), np.zeros(COUNT + dof)
            squares, used = fit_equations(model, entries, values, pose, sample.rays, own, gradient)
            total, number = total + squares, number + used
            share = effective / max(sample.rays.shape[1], 1)
            rows = np.concatenate([np.arange(COUNT), COUNT + k * dof + np.arange(dof)])
            a[np.ix_(rows, rows)] += share * own
            b[rows] += share * gradient
            coordinates = COUNT + k * dof + np.arange(ROOT, dof)
            a[coordinates, coordinates] += 1.0 / sample.looseness**2
            precision = np.concatenate([np.zeros(ROOT), np.full(dof - ROOT, 1.0 / sample.looseness**2)])
            held = np.zeros(dof)
            add_target_gradient(model, frames_of(model, pose), pose, pose._replace(values=sample.held), precision, held)
            b[rows[COUNT:]] += held
        a[np.arange(count), np.arange(count)] += 1e-3
        if not cholesky_solve(a, b):
            break
        step = b * min(1.0, FIT_MAX_STEP / max(1e-9, float(np.abs(b).max())))
        logs = np.clip(logs + step[:COUNT], -SIZE_LIMIT * SPREADS, SIZE_LIMIT * SPREADS)
        for k, pose in enumerate(poses):
            apply_step(model, frames_of(model, pose), step[COUNT + k * dof : COUNT + (k + 1) * dof], pose)
        gap = float(np.sqrt(total / max(number, 1.0)))
        if np.abs(step).max() < FIT_TOLERANCE:
            break
    return FittedBody(scaled(anatomy, average, logs), logs, tuple(poses), gap)


@kernel
def fit_equations(
    model: BodyModel, entries: Ints, values: Floats, pose: RootedPose, rays: Floats32, a: Floats, b: Floats
) -> tuple[float, float]:
    """Add one scene's normal equations, (COUNT + 6 + d, same) and (COUNT + 6 + d,), in sizes and pose.

    entries: (n, 4) and values (n,) that the factors multiply.  Returns the sum of squared gaps, and the number of rays.
    """
    parts, dof = model.parent.shape[0], ROOT + pose.values.shape[0]
    frames = frames_of(model, pose)
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    joint_screws(model, frames, screws, owner)
    above = np.zeros((parts, parts), dtype=np.bool_)  # above[i, j]: j is part i or between it and the root
    for part in range(parts):
        up = part
        while up >= 0:
            above[part, up] = True
            up = model.parent[up]
    found, row = np.empty(CONTACT_LENGTH), np.empty(COUNT + dof)
    squares = number = 0.0
    _, nearest = nearest_of(model, frames, rays)
    for i in range(rays.shape[1]):
        part = nearest[i]
        contact_on_part(model, frames[part], part, rays, i, found)
        weight = robust_weight(found[0], found[1], FIT_RESIDUAL_SCALE_M, FIT_RESIDUAL_LIMIT_M)
        if weight == 0.0:
            continue
        squares += min(np.abs(found[1]), FIT_GAP_TRUNCATION_M) ** 2
        number += 1.0
        row[:] = 0.0
        n0, n1, n2 = found[6], found[7], found[8]
        x, y, z = found[2] - pose.position[0], found[3] - pose.position[1], found[4] - pose.position[2]
        row[0] = n0 * x + n1 * y + n2 * z  # a change of stature scales everything about the root
        _sizes_row(model, frames, above, entries, values, rays[6:9, i], part, found, row)
        m0, m1, m2 = y * n2 - z * n1, z * n0 - x * n2, x * n1 - y * n0
        for k in range(dof):
            if above[part, owner[k]]:
                s = screws[k]
                row[COUNT + k] = s[0] * n0 + s[1] * n1 + s[2] * n2 + s[3] * m0 + s[4] * m1 + s[5] * m2
        for j in range(COUNT + dof):
            if row[j] != 0.0:
                b[j] += weight * found[1] * row[j]
                for k in range(COUNT + dof):
                    a[j, k] += weight * row[j] * row[k]
    return squares, number


@kernel
def _sizes_row(
    model: BodyModel, frames: Floats, above: Bools, entries: Ints, values: Floats, normal: Floats32,
    part: int, found: Floats, row: Floats,
) -> None:  # fmt: skip
    """Add to row, from 1 on, the motion of the contact along the normal for a relative change of every factor."""
    f, share = frames[part], found[5]
    turned, moving = np.empty(3), np.empty(3)  # the normal and the gap's derivative, in the part's frame
    for k in range(3):
        turned[k] = f[0, k] * normal[0] + f[1, k] * normal[1] + f[2, k] * normal[2]
        moving[k] = f[0, k] * found[6] + f[1, k] * found[7] + f[2, k] * found[8]
    rx = model.radii[part, 0] + share * (model.radii[part, 2] - model.radii[part, 0])
    rz = model.radii[part, 1] + share * (model.radii[part, 3] - model.radii[part, 1])
    rm = 0.5 * (rx + rz)
    support = np.sqrt((rx * turned[0]) ** 2 + (rm * turned[1]) ** 2 + (rz * turned[2]) ** 2) + 1e-12
    by_long = (rx * turned[0] ** 2 + 0.5 * rm * turned[1] ** 2) / support
    by_short = (rz * turned[2] ** 2 + 0.5 * rm * turned[1] ** 2) / support
    for n in range(entries.shape[0]):
        array, place_of, column = entries[n, 1], entries[n, 2], entries[n, 3]
        moved = 0.0
        if array == OFFSETS:
            if place_of > 0 and above[part, place_of]:
                up = frames[model.parent[place_of]]
                moved = up[0, column] * found[6] + up[1, column] * found[7] + up[2, column] * found[8]
        elif place_of == part:
            if array == BASES:
                moved = moving[column]
            elif array == SIZES and column == LENGTH:
                moved = share * moving[1]
            elif array == SIZES:
                moved = (1.0 - share) * (by_long if column == 1 else by_short)
            elif array == TIPS:  # the round cap of a free end is within its length
                moved = share * (by_long if column == 0 else by_short) - model.free[part] * 0.5 * share * moving[1]
        row[entries[n, 0]] += moved * values[n]
