"""Online estimation of body sizes from new postures.

Every posture that differs from the previous ones adds its information on the sizes, with its own pose marginalized out.
"""

# Paper (added): in [Hybrid II] the lengths of the body are constant.

from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.body.jacobian import ROOT
from zenocap.services.tracker.body.sizes import COUNT, SPREADS, entries_of, scaled, values_of
from zenocap.services.tracker.filter.cholesky import cholesky_solve, schur_complement
from zenocap.services.tracker.initialization.body_fitting import fit_equations


@dataclass(frozen=True, eq=False)
class ShapeEstimate:
    """Estimate of the sizes.  average: body that the factors multiply.  logs: (COUNT,) of the body in use.

    information: (COUNT, COUNT) and gradient (COUNT,) of the logs from all postures, prior of the average body included.
    postures: (d,) coordinates of each posture used.
    """

    average: Bdp
    logs: Floats
    information: Floats
    gradient: Floats
    postures: tuple[Floats, ...] = ()


def initial_shape(average: Bdp, logs: Floats | None = None) -> ShapeEstimate:
    """Estimate before any posture; logs: of the body in use, such as the one measured in the T-pose; None: the average."""
    logs = np.zeros(COUNT) if logs is None else logs
    return ShapeEstimate(average, logs, np.diag(1.0 / SPREADS**2), np.zeros(COUNT))


def is_new_posture(shape: ShapeEstimate, pose: RootedPose) -> bool:
    """True when a posture differs enough from those used before."""
    if len(shape.postures) >= p.MAX_POSTURES:
        return False
    return all(float(np.abs(pose.values - known).max()) > p.NEW_POSTURE_ANGLE for known in shape.postures)


def updated_shape(
    anatomy: Anatomy, shape: ShapeEstimate, rays: Floats32, pose: RootedPose, effective: float = p.POSTURE_INDEPENDENT_RAYS
) -> ShapeEstimate:
    """Estimate with one more posture, in a scene of rays (11, n); logs stay those of the body in use."""
    body = scaled(anatomy, shape.average, shape.logs)
    dof = ROOT + len(pose.values)
    own, gradient = np.zeros((COUNT + dof, COUNT + dof)), np.zeros(COUNT + dof)
    fit_equations(model_of(anatomy, body), entries_of(anatomy), values_of(anatomy, body), pose, rays, own, gradient)
    own *= effective / max(rays.shape[1], 1)
    gradient *= effective / max(rays.shape[1], 1)
    held = np.repeat(p.POSTURE_DEVIATION, [3, 3, dof - ROOT])
    own[np.arange(COUNT, COUNT + dof), np.arange(COUNT, COUNT + dof)] += 1.0 / held**2
    information, total = np.empty((COUNT, COUNT)), np.empty(COUNT)
    if not schur_complement(own, gradient, COUNT, information, total):  # the pose follows the sizes
        return shape
    total += np.sum(information * shape.logs, axis=1)
    return replace(
        shape,
        information=shape.information + information,
        gradient=shape.gradient + total,
        postures=(*shape.postures, pose.values.copy()),
    )


def improved_body(anatomy: Anatomy, shape: ShapeEstimate) -> tuple[ShapeEstimate, Bdp] | None:
    """Estimate and body with the logs that all postures give, when they differ enough from those in use."""
    logs = shape.gradient.copy()
    if not cholesky_solve(shape.information.copy(), logs):
        return None
    logs = np.clip(logs, -p.SIZE_LIMIT * SPREADS, p.SIZE_LIMIT * SPREADS)
    if float(np.abs(logs - shape.logs).max()) < p.SHAPE_CHANGE:
        return None
    return replace(shape, logs=logs), scaled(anatomy, shape.average, logs)
