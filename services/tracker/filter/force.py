"""Refinement of a pose by simulated force and moment, corrected.  [Hybrid V-B, Eq. 32-41]

Comments state the differences to the print, which `force_printed` keeps.  Its fixed points are those of Gauss-Newton.
"""

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, forward_kinematics
from zenocap.services.tracker.body.jacobian import ROOT, add_target_gradient, apply_step
from zenocap.services.tracker.evidence.rays import CONTACT_LENGTH, contact_on_part, nearest_of
from zenocap.services.tracker.evidence.residuals import Weights, robust_weight
from zenocap.services.tracker.parameters import FORCE_MOMENTUM


@kernel
def generalized_forces(
    model: BodyModel, frames: Floats, rays: Floats32, weights: Weights, gradients: Floats, bounds: Floats
) -> None:
    """Sum the forces and moments of the scene on every degree of freedom: gradients and bounds (6 + d,), overwritten.

    Forces are along the world's axes; moments about the joint's axes: a hinge's, else those of the part that turns.
    A force acts on every joint between its part and the root, and on the root's position.  [Hybrid Eq. 38-40]
    bounds: upper bounds of the curvature when all degrees of freedom that share a force move at once: number of points,
    times their squared levers, times the sharing degrees of freedom.
    """
    gradients[:] = 0.0
    bounds[:] = 0.0
    found, moment, about = np.empty(CONTACT_LENGTH), np.empty(3), np.empty(3)
    distances, parts = nearest_of(model, frames, rays)
    for i in range(rays.shape[1]):
        if distances[i] >= weights.limit:
            continue
        contact_on_part(model, frames[parts[i]], parts[i], rays, i, found)
        weight = weights.ray_weight * robust_weight(found[0], found[1], weights.spread, weights.limit)
        sharing, up = 1, parts[i]  # the root's position is one
        while up >= 0:
            sharing += 1 if up == 0 or model.kind[up] > 0 else 0
            up = model.parent[up]
        # Paper (corrected): Eq. 32 is quadratic, from scene to model; here linear up to a limit, from model to scene.
        # Paper (replaced): mF of Eq. 32, and so of Eq. 36-41, is left out: normals of ray and contact are equal, mF = 1.
        force = weight * found[1]  # along found[6:9], from model to scene
        stiff = weight * sharing
        sides = np.abs(found[6]) + np.abs(found[7]) + np.abs(found[8])
        for k in range(3):
            gradients[k] += force * found[6 + k]
            bounds[k] += stiff * np.abs(found[6 + k]) * sides
        up = parts[i]
        while up >= 0:
            if up == 0 or model.kind[up] > 0:
                f = frames[up]
                x, y, z = found[2] - f[0, 3], found[3] - f[1, 3], found[4] - f[2, 3]
                # Paper (corrected): Eq. 33 prints F x L; L x F turns towards the scene.
                moment[0] = y * found[8] - z * found[7]  # L x F, Eq. 33
                moment[1] = z * found[6] - x * found[8]
                moment[2] = x * found[7] - y * found[6]
                for k in range(3):
                    about[k] = f[0, k] * moment[0] + f[1, k] * moment[1] + f[2, k] * moment[2]
                # Paper (replaced): Eq. 39 and 40 add moments to angles; here moments turn joints about their own axes.
                if model.kind[up] == 1:
                    row, lever = ROOT + model.first[up], about[model.axis[up]]
                    gradients[row] += force * lever
                    bounds[row] += stiff * lever * lever
                else:
                    row = 3 if up == 0 else ROOT + model.first[up]
                    sides = np.abs(about[0]) + np.abs(about[1]) + np.abs(about[2])
                    for k in range(3):
                        gradients[row + k] += force * about[k]
                        bounds[row + k] += stiff * np.abs(about[k]) * sides
            up = model.parent[up]


@kernel
def rotate_turns(model: BodyModel, frames: Floats, step: Floats, to_world: bool, out: Floats) -> None:
    """Write a step (6 + d,) to out, with its turns from the axes of the turning parts to the world's, or back."""
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


@kernel
def refine_by_force(
    model: BodyModel, rays: Floats32, weights: Weights, iterations: int, pose: RootedPose, target: RootedPose
) -> None:
    """Refine a pose in place by simulated forces and moments, with a Gaussian prior at the target, as `refine`.

    Without momentum every step lessens the sum of squares while the contacts stay: for weights p that sum to 1,
    (sum of x)^2 <= sum of x^2 / p.  Momentum accelerates it and is reset where it points against the forces.
    """
    count, dof = model.parent.shape[0], ROOT + pose.values.shape[0]
    frames = np.empty((count, 3, 4))
    gradients, bounds, held, local = np.empty(dof), np.empty(dof), np.empty(dof), np.empty(dof)
    motion = np.zeros(dof)
    for _ in range(iterations):
        forward_kinematics(model, pose, frames)
        generalized_forces(model, frames, rays, weights, gradients, bounds)
        # Paper (added): a Gaussian at the target pose, which V-B does not have.
        held[:] = 0.0
        add_target_gradient(model, frames, pose, target, weights.precision, held)
        rotate_turns(model, frames, held, False, local)
        work = 0.0
        for k in range(dof):
            gradients[k] += local[k]
            work += gradients[k] * motion[k]
        for k in range(dof):
            # Paper (open): Eq. 34 and 35 give no coefficients; here by the number of points and their levers.
            # Paper (added): momentum.
            step = gradients[k] / (bounds[k] + weights.precision[k] + 1e-6)
            motion[k] = step + (FORCE_MOMENTUM * motion[k] if work > 0.0 else 0.0)
        rotate_turns(model, frames, motion, True, local)
        apply_step(model, frames, local, pose)
