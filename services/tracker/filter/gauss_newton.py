"""Damped Gauss-Newton refinement of a pose; replaces [Hybrid V-B] by default."""

# Paper (replaced): V-B moves by forces and moments, Eq. 32-40; here by least squares on the residuals of the same rays.

import numpy as np

from zenocap.common.jit import kernel
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, forward_kinematics
from zenocap.services.tracker.body.jacobian import ROOT, add_target_gradient, apply_step, joint_screws, normal_equations
from zenocap.services.tracker.evidence.evidence import Evidence, add
from zenocap.services.tracker.evidence.residuals import Weights
from zenocap.services.tracker.filter.cholesky import cholesky_solve
from zenocap.services.tracker.parameters import CONVERGED_STEP


@kernel
def refine(
    model: BodyModel, evidence: Evidence, weights: Weights, iterations: int, pose: RootedPose, target: RootedPose
) -> None:
    """Refine a pose in place by damped Gauss-Newton, with a Gaussian prior at the target.

    At most `iterations` steps; ends with the first short one.
    """
    count, dof = model.parent.shape[0], ROOT + pose.values.shape[0]
    frames = np.empty((count, 3, 4))
    matrices, gradients = np.empty((count, 6, 6)), np.empty((count, 6))
    screws, owner = np.empty((dof, 6)), np.empty(dof, dtype=np.int64)
    a, b = np.empty((dof, dof)), np.empty(dof)
    for _ in range(iterations):
        forward_kinematics(model, pose, frames)
        add(model, frames, evidence, weights, matrices, gradients)
        joint_screws(model, frames, screws, owner)
        normal_equations(model, screws, owner, matrices, gradients, a, b)
        for k in range(dof):
            a[k, k] += weights.precision[k] + 1e-6
        add_target_gradient(model, frames, pose, target, weights.precision, b)
        if not cholesky_solve(a, b):
            return
        apply_step(model, frames, b, pose)
        if np.abs(b).max() < CONVERGED_STEP:
            return
