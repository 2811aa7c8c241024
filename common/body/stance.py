"""Legs whose feet stay where they are while the hips move: two-bone inverse kinematics."""

import numpy as np

from common.body.anatomy import Floats

LONGEST = 0.9999  # of the stretched leg


def knees_to_feet(directions: Floats, move: Floats, lengths: Floats) -> Floats:
    """Leg directions (2, 3) after the hip moved by `move` (3,) metres with the foot fixed, in the frame of `directions`.

    directions: (2, 3) unit vectors of upper and lower leg before.  lengths: (2,) metres.  The knee stays on its side of the
    line from hip to foot.  A foot out of reach is drawn along.
    """
    upper, lower = lengths
    knee = upper * directions[0] - move
    foot = upper * directions[0] + lower * directions[1] - move
    distance = float(np.linalg.norm(foot))
    if distance < abs(upper - lower) + 1e-6:
        return directions
    along = foot / distance
    distance = min(distance, LONGEST * float(upper + lower))
    side = knee - (knee @ along) * along
    norm = float(np.linalg.norm(side))
    if norm < 1e-4:
        return np.stack([along, along])
    reach = (upper**2 - lower**2 + distance**2) / (2 * distance)
    knee = reach * along + np.sqrt(max(upper**2 - reach**2, 0.0)) * side / norm
    shin = distance * along - knee
    return np.stack([knee / upper, shin / np.linalg.norm(shin)])
