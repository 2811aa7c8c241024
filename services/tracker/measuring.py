"""Measuring the body: its sizes and its poses together, from scenes of one person."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of
from common.body.definition import Bdp
from services.tracker.closest import FOUND, Singles, contact, influence, nearest_parts
from services.tracker.linkage import ROOT, hold, move, screws_of
from services.tracker.model import Ints, Model, model_of, place
from services.tracker.posed import Posed
from services.tracker.sizes import BASES, COUNT, LENGTH, OFFSETS, SIZES, SPREADS, TIPS, entries_of, scaled, values_of
from services.tracker.solving import solve

SPREAD_M, LIMIT_M = 0.01, 0.20  # of a gap, and beyond which a ray belongs to nothing
EFFECTIVE = 300.0  # rays of a scene count as so many independent ones: the body's shape is wrong in stretches, not points
ENOUGH = 1e-3  # change of a logarithm, metre or radian that is no change
LONGEST_STEP = 0.3


@dataclass(frozen=True)
class Sample:
    """One scene to measure in: rays (11, n), a pose to begin from, and how far (radians) its coordinates may go from it."""

    rays: Singles
    pose: Posed
    held: Floats
    looseness: float


@dataclass(frozen=True)
class Measured:
    """logs: (COUNT,) see `scaled`.  poses: of the samples.  gap: root mean square, metres."""

    body: Bdp
    logs: Floats
    poses: tuple[Posed, ...]
    gap: float


def measure(
    anatomy: Anatomy,
    average: Bdp,
    samples: Sequence[Sample],
    logs: Floats,
    iterations: int,
    effective: float = EFFECTIVE,
) -> Measured:
    """The body that explains the samples best, from an average one and logs (COUNT,) to begin with.

    Gauss-Newton on the gaps of all rays, over the sizes' factors and every sample's pose.  effective: independent rays of
    a sample; the fewer, the more the body stays an average one.
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
            own, pull = np.zeros((COUNT + dof, COUNT + dof)), np.zeros(COUNT + dof)
            squares, seen = equations(
                model, entries, values, pose.position, pose.rotation, pose.values, sample.rays, own, pull
            )
            total, number = total + squares, number + seen
            share = effective / max(sample.rays.shape[1], 1)
            rows = np.concatenate([np.arange(COUNT), COUNT + k * dof + np.arange(dof)])
            a[np.ix_(rows, rows)] += share * own
            b[rows] += share * pull
            coordinates = COUNT + k * dof + np.arange(ROOT, dof)
            a[coordinates, coordinates] += 1.0 / sample.looseness**2
            frames = np.empty((len(model.parent), 3, 4))
            place(model, pose.position, pose.rotation, pose.values, frames)
            precision = np.concatenate([np.zeros(ROOT), np.full(dof - ROOT, 1.0 / sample.looseness**2)])
            held = np.zeros(dof)
            hold(
                model, frames, pose.position, pose.rotation, pose.values,
                pose.position, pose.rotation, sample.held, precision, held,
            )  # fmt: skip
            b[rows[COUNT:]] += held
        a[np.arange(count), np.arange(count)] += 1e-3
        if not solve(a, b):
            break
        step = b
        step *= min(1.0, LONGEST_STEP / max(1e-9, float(np.abs(step).max())))
        logs += step[:COUNT]
        for k, pose in enumerate(poses):
            frames = np.empty((len(model.parent), 3, 4))
            place(model, pose.position, pose.rotation, pose.values, frames)
            move(model, frames, step[COUNT + k * dof : COUNT + (k + 1) * dof], pose.position, pose.rotation, pose.values)
        gap = float(np.sqrt(total / max(number, 1.0)))
        if np.abs(step).max() < ENOUGH:
            break
    return Measured(scaled(anatomy, average, logs), logs, tuple(poses), gap)


@njit(cache=True, error_model="numpy")
def equations(
    model: Model,
    entries: Ints,
    values: Floats,
    position: Floats,
    rotation: Floats,
    coordinates: Floats,
    rays: Singles,
    a: Floats,
    b: Floats,
) -> tuple[float, float]:
    """Add one scene's normal equations, (COUNT + 6 + d, same) and (COUNT + 6 + d,), in sizes and pose.

    entries: (n, 4) and values (n,), what the factors multiply.  Returns the sum of squared gaps, and of how many rays.
    """
    parts, dof = model.parent.shape[0], ROOT + coordinates.shape[0]
    frames = np.empty((parts, 3, 4))
    place(model, position, rotation, coordinates, frames)
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    screws_of(model, frames, screws, owner)
    above = np.zeros((parts, parts), dtype=np.bool_)  # above[i, j]: j is part i or between it and the root
    for part in range(parts):
        up = part
        while up >= 0:
            above[part, up] = True
            up = model.parent[up]
    found, row = np.empty(FOUND), np.empty(COUNT + dof)
    squares = number = 0.0
    distances, nearest = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    nearest_parts(model, frames, rays, distances, nearest)
    for i in range(rays.shape[1]):
        part = nearest[i]
        contact(model, frames[part], part, rays, i, found)
        weight = influence(found, SPREAD_M, LIMIT_M)
        if weight == 0.0:
            continue
        squares += min(np.abs(found[1]), 0.05) ** 2
        number += 1.0
        row[:] = 0.0
        n0, n1, n2 = found[6], found[7], found[8]
        x, y, z = found[2] - position[0], found[3] - position[1], found[4] - position[2]
        row[0] = n0 * x + n1 * y + n2 * z  # all grows from the root
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


@njit(cache=True, error_model="numpy")
def _sizes_row(
    model: Model,
    frames: Floats,
    above: NDArray[np.bool_],
    entries: Ints,
    values: Floats,
    normal: Singles,
    part: int,
    found: Floats,
    row: Floats,
) -> None:
    """How far the contact moves along the normal for a relative change of every factor; added to row from 1 on."""
    f, share = frames[part], found[5]
    turned, moving = np.empty(3), np.empty(3)  # the normal, and what a motion counts, in the part's frame
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
