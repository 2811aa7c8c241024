"""Loading what is compiled before the first frame: otherwise the first person seen, or lost, costs a viewer frames."""

import numpy as np

from common.body.definition import neutral_pose
from common.body.limbs import limb_angles, limb_directions, resting_arm
from common.body.proportions import body_from_lengths, lengths_of_height
from services.viewer.arms import find_arm
from services.viewer.body_fit import BodyFit, body_model
from services.viewer.legs import LEFT, RIGHT, exchange_gain, find_leg_facade, find_leg_flank
from services.viewer.position import sight
from services.viewer.states import Setup


def load_compiled(setup: Setup) -> float:
    """Search once for a person who stands 4 m before the camera; returns the matching score of what was found."""
    anatomy = setup.anatomy
    model = body_model(anatomy, body_from_lengths(anatomy, lengths_of_height(1.75)))
    centre, forward = setup.level.camera.centre, setup.rows[2]
    pose = neutral_pose(anatomy, centre + 4.0 * forward)
    directions = limb_directions(anatomy, pose.angles)
    empty = np.zeros((setup.level.camera.size[1], setup.level.camera.size[0]), np.uint8)
    drawn = BodyFit(model, setup.rows, empty)
    drawn.place(pose.position, np.eye(3), directions)
    fit = BodyFit(model, setup.rows, (drawn.picture.cover > 0).astype(np.uint8))
    found = sight(fit, pose.position, np.eye(3), directions)
    fit.place(found.position, np.eye(3), directions)
    standing, resting = directions[RIGHT], resting_arm(np.eye(3), 0.0)
    for k in (RIGHT, LEFT):
        find_leg_facade(fit, k, squatting=True)
        find_leg_flank(fit, k, standing, lost=True)
    for k in (0, 1):
        find_arm(fit, k, resting, lost=True)
    exchange_gain(fit)
    limb_angles(anatomy, fit.directions, pose.angles)
    return fit.score()
