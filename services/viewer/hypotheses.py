"""Other ways the limbs may be, scored in both views before the search: what one view cannot tell, the other may.

Seen from the side both arms, and both legs, explain the same pixels.  Each viewer therefore scores the same few poses in
three dimensions, made from the universal BAP that both have; the integrator adds the scores up and says which one the limb
searches begin from.  [Two-view 3.3, 3.4] let each viewer decide alone.
"""

import numpy as np
from numba import njit

from common.body.anatomy import Floats
from common.vision.model_image import ADD, COUNT, REMOVE, score_of
from services.viewer.body_fit import BodyFit, BodyModel
from services.viewer.limb_search import LimbBody, Picture, cover_limb

ARM_WAYS, LEG_WAYS = 6, 2  # ways of one limb; both limbs of a pair are tried in all combinations
FORWARD, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


def arm_ways(expected: Floats, resting: Floats) -> Floats:
    """(2, ARM_WAYS, 2, 3) of right and left arm: as expected, like the other arm, hanging, forward, sideways, up.

    expected: (4, 2, 3) and resting: (2, 3) in the torso's frame.
    """
    mirror = np.array([-1.0, 1.0, 1.0])
    ways = np.empty((2, ARM_WAYS, 2, 3))
    for k, out in ((0, -1.0), (1, 1.0)):
        ways[k, 0] = expected[k]
        ways[k, 1] = expected[1 - k] * mirror
        ways[k, 2] = resting
        ways[k, 3:, :] = np.stack([FORWARD, np.array([out, 0.0, 0.0]), UP])[:, None]
    return ways


def leg_ways(expected: Floats) -> Floats:
    """(2, LEG_WAYS, 2, 3) directions of right and left leg: as expected, and as the other leg but on its own side."""
    ways = np.empty((2, LEG_WAYS, 2, 3))
    for k in (0, 1):
        ways[k, 0] = expected[2 + k]
        twin = expected[3 - k].copy()
        twin[:, 0] = expected[2 + k][:, 0]
        ways[k, 1] = twin / np.linalg.norm(twin, axis=1, keepdims=True)
    return ways


def chosen(ways: Floats, index: int) -> Floats:
    """(2, 2, 3) directions of both limbs in the combination `index` of `way_scores`."""
    first, second = divmod(index % ways.shape[1] ** 2, ways.shape[1])
    return np.stack([ways[0, first], ways[1, second]])


def way_scores(fit: BodyFit, first: int, ways: Floats) -> Floats:
    """(n * n,) log matching scores with limbs `first` and `first` + 1 in every combination of their `ways` (2, n, 2, 3).

    Entry i * n + j has the first limb in its way i and the second in its way j.  The fit is left as it was.
    """
    fit.limb(first, REMOVE)
    fit.limb(first + 1, REMOVE)
    scores = _scores(fit.position, first, ways, fit.model, fit.picture)
    fit.limb(first, ADD)
    fit.limb(first + 1, ADD)
    return scores


@njit(cache=True, error_model="numpy")
def _scores(position: Floats, first: int, ways: Floats, model: BodyModel, picture: Picture) -> Floats:
    count = ways.shape[1]
    scores = np.empty(count * count)
    origins = np.empty((2, 3))
    for k in range(2):
        for row in range(3):
            origins[k, row] = position[row]
            for column in range(3):
                origins[k, row] += picture.torso_to_world[row, column] * model.origins[first + k, column]
    one = LimbBody(origins[0], model.limbs[first], first >= 2, ways[0, 0])
    two = LimbBody(origins[1], model.limbs[first + 1], first >= 2, ways[1, 0])
    for i in range(count):
        cover_limb(ways[0, i], one, picture, ADD, picture.totals)
        for j in range(count):
            totals = picture.totals.copy()
            cover_limb(ways[1, j], two, picture, COUNT, totals)
            scores[i * count + j] = np.log(score_of(totals[0], totals[1], totals[2]) + 1e-3)
        cover_limb(ways[0, i], one, picture, REMOVE, picture.totals)
    return scores
