"""Refinement of a pose by simulated force and moment, corrected.  [Hybrid V-B, Eq. 32-41]

Against the print (`force_printed` keeps it): the force grows linearly with the gap, up to where it stays, instead of with
its square; it points from the model to the scene, as in the paper's Fig. 2; Eq. 33 is L x F; moments turn joints about
their own axes; and the coefficients of Eq. 34 and 35 follow from the number of points and their levers, so that no step
is ever too long.  It comes to rest where Gauss-Newton does.
"""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from services.tracker.closest import FOUND, Numbers, Singles, contact, influence, nearest_parts
from services.tracker.linkage import ROOT, hold, move
from services.tracker.model import Model, place
from services.tracker.refine import Weights

MOMENTUM = 0.85  # what remains of a motion from one step to the next


@njit(cache=True, error_model="numpy")
def forces_on(
    model: Model,
    frames: Floats,
    rays: Singles,
    weights: Weights,
    distances: Singles,
    parts: Numbers,
    pulls: Floats,
    stiffness: Floats,
) -> None:
    """Sum up the forces and moments of the scene on every degree of freedom: pulls and stiffness (6 + d,), overwritten.

    Forces are along the world's axes; moments about the joint's axes: a hinge's, else those of the part that turns.
    A force acts on every joint between its part and the root, and on the root's position.  [Hybrid Eq. 38-40]
    stiffness: how much less it pulls for a unit of the motion, at most, when all that share a force follow it at once:
    the number of points, times their squared levers, times those that share.  distances, parts: (n,) scratch.
    """
    pulls[:] = 0.0
    stiffness[:] = 0.0
    found, moment, about = np.empty(FOUND), np.empty(3), np.empty(3)
    nearest_parts(model, frames, rays, distances, parts)
    for i in range(rays.shape[1]):
        if distances[i] >= weights.limit:
            continue
        contact(model, frames[parts[i]], parts[i], rays, i, found)
        weight = weights.share * influence(found, weights.spread, weights.limit)
        sharing, up = 1, parts[i]  # the root's position is one
        while up >= 0:
            sharing += 1 if up == 0 or model.kind[up] > 0 else 0
            up = model.parent[up]
        force = weight * found[1]  # along found[6:9], from model to scene
        stiff = weight * sharing
        sides = np.abs(found[6]) + np.abs(found[7]) + np.abs(found[8])
        for k in range(3):
            pulls[k] += force * found[6 + k]
            stiffness[k] += stiff * np.abs(found[6 + k]) * sides
        up = parts[i]
        while up >= 0:
            if up == 0 or model.kind[up] > 0:
                f = frames[up]
                x, y, z = found[2] - f[0, 3], found[3] - f[1, 3], found[4] - f[2, 3]
                moment[0] = y * found[8] - z * found[7]  # L x F, Eq. 33
                moment[1] = z * found[6] - x * found[8]
                moment[2] = x * found[7] - y * found[6]
                for k in range(3):
                    about[k] = f[0, k] * moment[0] + f[1, k] * moment[1] + f[2, k] * moment[2]
                if model.kind[up] == 1:
                    row, lever = ROOT + model.first[up], about[model.axis[up]]
                    pulls[row] += force * lever
                    stiffness[row] += stiff * lever * lever
                else:
                    row = 3 if up == 0 else ROOT + model.first[up]
                    sides = np.abs(about[0]) + np.abs(about[1]) + np.abs(about[2])
                    for k in range(3):
                        pulls[row + k] += force * about[k]
                        stiffness[row + k] += stiff * np.abs(about[k]) * sides
            up = model.parent[up]


@njit(cache=True, error_model="numpy")
def turned(model: Model, frames: Floats, step: Floats, to_world: bool, out: Floats) -> None:
    """Write a step (6 + d,) to out, its turns from the axes of the parts that turn to the world's, or back."""
    for k in range(step.shape[0]):
        out[k] = step[k]
    for part in range(frames.shape[0]):
        if part > 0 and model.kind[part] != 3:
            continue
        row = 3 if part == 0 else ROOT + model.first[part]
        for k in range(3):
            out[row + k] = 0.0
            for n in range(3):
                out[row + k] += (frames[part, k, n] if to_world else frames[part, n, k]) * step[row + n]


@njit(cache=True, error_model="numpy")
def refine_by_force(
    model: Model,
    rays: Singles,
    weights: Weights,
    iterations: int,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
) -> None:
    """Move a pose in place: position (3,), rotation (3, 3) and values (d,), held near its target.  As `refine`.

    Without momentum every step lessens the sum of squares while the contacts stay: for shares p that sum up to 1,
    (sum of x)^2 <= sum of x^2 / p.  The momentum takes it there sooner; it ends where it points against the forces.
    """
    count, dof = model.parent.shape[0], ROOT + values.shape[0]
    frames = np.empty((count, 3, 4))
    pulls, stiffness, held, local = np.empty(dof), np.empty(dof), np.empty(dof), np.empty(dof)
    motion = np.zeros(dof)
    distances, parts = np.empty(rays.shape[1], dtype=np.float32), np.empty(rays.shape[1], dtype=np.int32)
    for _ in range(iterations):
        place(model, position, rotation, values, frames)
        forces_on(model, frames, rays, weights, distances, parts, pulls, stiffness)
        held[:] = 0.0
        hold(
            model, frames, position, rotation, values,
            target_position, target_rotation, target_values, weights.precision, held,
        )  # fmt: skip
        turned(model, frames, held, False, local)
        work = 0.0
        for k in range(dof):
            pulls[k] += local[k]
            work += pulls[k] * motion[k]
        for k in range(dof):
            step = pulls[k] / (stiffness[k] + weights.precision[k] + 1e-6)
            motion[k] = step + (MOMENTUM * motion[k] if work > 0.0 else 0.0)
        turned(model, frames, motion, True, local)
        move(model, frames, local, position, rotation, values)
