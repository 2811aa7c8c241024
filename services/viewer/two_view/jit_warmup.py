"""Compilation of the viewer's kernels before the first frame."""

import numpy as np

from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.body.segments import hanging_arm, limb_angles, limb_directions
from zenocap.services.viewer.two_view.body_fit import BodyFit, body_model
from zenocap.services.viewer.two_view.joint_angles import (
    LEFT_LEG,
    RIGHT_LEG,
    find_arm,
    find_leg_facade,
    find_leg_flank,
    leg_exchange_gain,
)
from zenocap.services.viewer.two_view.position import estimate_torso
from zenocap.services.viewer.two_view.states import TwoViewSetup


def load_compiled(setup: TwoViewSetup) -> float:
    """Search once for a model person 4 m in front of the camera; returns the matching score of the result."""
    anatomy = setup.anatomy
    model = body_model(anatomy, body_from_lengths(anatomy, average_lengths(1.75)))
    centre, forward = setup.level.camera.centre, setup.rows[2]
    pose = neutral_pose(anatomy, centre + 4.0 * forward)
    directions = limb_directions(anatomy, pose.angles)
    empty = np.zeros((setup.level.camera.size[1], setup.level.camera.size[0]), np.uint8)
    drawn = BodyFit(model, setup.rows, empty)
    drawn.place(pose.position, np.eye(3), directions)
    fit = BodyFit(model, setup.rows, (drawn.image.cover > 0).astype(np.uint8))
    found = estimate_torso(fit, pose.position, np.eye(3), directions)
    fit.place(found.position, np.eye(3), directions)
    standing, resting = directions[RIGHT_LEG], hanging_arm(np.eye(3), 0.0)
    for k in (RIGHT_LEG, LEFT_LEG):
        find_leg_facade(fit, k, squatting=True)
        find_leg_flank(fit, k, standing, lost=True)
    for k in (0, 1):
        find_arm(fit, k, resting, lost=True)
    leg_exchange_gain(fit)
    limb_angles(anatomy, fit.directions, pose.angles)
    return fit.score()
