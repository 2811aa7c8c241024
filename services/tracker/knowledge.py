"""What is known of a body's sizes grows while the person moves: a knee that bends shows where it is.

Every posture that differs from those before adds its information on the sizes, with its own pose marginalised out.
"""

from dataclasses import dataclass, replace

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Bdp
from services.tracker.closest import Singles
from services.tracker.linkage import ROOT
from services.tracker.measuring import equations
from services.tracker.model import model_of
from services.tracker.posed import Posed
from services.tracker.sizes import COUNT, SPREADS, entries_of, scaled, values_of
from services.tracker.solving import marginal, solve

NEW = 0.35  # rad: so far at least one coordinate must be from every posture that was learnt from
MOST = 60  # postures
EFFECTIVE = 60.0  # independent rays of a posture: the same wrong shape is seen again and again
CHANGED = 0.004  # of a logarithm of a size: then the body in use is replaced
POSE = (0.05, 0.1, 0.3)  # m, rad, rad: about where the pose was found


@dataclass(frozen=True, eq=False)
class Knowledge:
    """average: the body that the factors multiply.  logs: (COUNT,) of the body in use.

    information: (COUNT, COUNT) and pull (COUNT,): what all postures say of the logs, the average's own spread included.
    postures: (d,) coordinates of each that was learnt from.
    """

    average: Bdp
    logs: Floats
    information: Floats
    pull: Floats
    postures: tuple[Floats, ...] = ()


def beginning(average: Bdp, logs: Floats) -> Knowledge:
    """Before any posture; logs: of the body in use, such as the one measured in the initial posture."""
    return Knowledge(average, logs, np.diag(1.0 / SPREADS**2), np.zeros(COUNT))


def is_new(knowledge: Knowledge, pose: Posed) -> bool:
    """Whether a posture can teach anything."""
    if len(knowledge.postures) >= MOST:
        return False
    return all(float(np.abs(pose.values - known).max()) > NEW for known in knowledge.postures)


def learnt(anatomy: Anatomy, knowledge: Knowledge, rays: Singles, pose: Posed, effective: float = EFFECTIVE) -> Knowledge:
    """Knowledge with one more posture, in a scene of rays (11, n); logs stay those of the body in use."""
    body = scaled(anatomy, knowledge.average, knowledge.logs)
    dof = ROOT + len(pose.values)
    own, pull = np.zeros((COUNT + dof, COUNT + dof)), np.zeros(COUNT + dof)
    equations(
        model_of(anatomy, body), entries_of(anatomy), values_of(anatomy, body),
        pose.position, pose.rotation, pose.values, rays, own, pull,
    )  # fmt: skip
    own *= effective / max(rays.shape[1], 1)
    pull *= effective / max(rays.shape[1], 1)
    held = np.concatenate([np.full(3, POSE[0]), np.full(3, POSE[1]), np.full(dof - ROOT, POSE[2])])
    own[np.arange(COUNT, COUNT + dof), np.arange(COUNT, COUNT + dof)] += 1.0 / held**2
    information, total = np.empty((COUNT, COUNT)), np.empty(COUNT)
    if not marginal(own, pull, COUNT, information, total):  # the pose follows the sizes
        return knowledge
    total += np.sum(information * knowledge.logs, axis=1)
    return replace(
        knowledge,
        information=knowledge.information + information,
        pull=knowledge.pull + total,
        postures=(*knowledge.postures, pose.values.copy()),
    )


def improved(anatomy: Anatomy, knowledge: Knowledge) -> tuple[Knowledge, Bdp] | None:
    """The body that all postures together say, when it differs enough from the one in use."""
    logs = knowledge.pull.copy()
    if not solve(knowledge.information.copy(), logs):
        return None
    if float(np.abs(logs - knowledge.logs).max()) < CHANGED:
        return None
    return replace(knowledge, logs=logs), scaled(anatomy, knowledge.average, logs)
