"""Hypotheses of limb directions, scored by both viewers before the limb search.

In the flank both arms, and both legs, cover the same pixels.  Each viewer scores the same few three-dimensional
directions, derived from the universal BAP that both have.  The integrator adds the scores and publishes the hypothesis from
which the limb searches start.  Both limbs of a pair are scored in all combinations.
"""

# Paper (added): in 3.3 and 3.4 each viewer decides alone and starts from the previous angles only.

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.jit import kernel
from zenocap.common.vision.model_image import ADD, COUNT, REMOVE, score_of_counts
from zenocap.services.viewer.two_view.body_fit import BodyFit, PersonSizes
from zenocap.services.viewer.two_view.limb_search import CoverImage, LimbBody, cover_limb

ARM_HYPOTHESES, LEG_HYPOTHESES = 6, 2  # per limb
FORWARD, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


def arm_hypotheses(last: Floats, resting: Floats) -> Floats:
    """(2, ARM_HYPOTHESES, 2, 3) of right and left arm: last, mirrored other arm, hanging, forward, sideways, up.

    last: (4, 2, 3) and resting: (2, 3) in the torso's frame.
    """
    mirror = np.array([-1.0, 1.0, 1.0])
    hypotheses = np.empty((2, ARM_HYPOTHESES, 2, 3))
    for k, out in ((0, -1.0), (1, 1.0)):
        hypotheses[k, 0] = last[k]
        hypotheses[k, 1] = last[1 - k] * mirror
        hypotheses[k, 2] = resting
        hypotheses[k, 3:, :] = np.stack([FORWARD, np.array([out, 0.0, 0.0]), UP])[:, None]
    return hypotheses


def leg_hypotheses(last: Floats) -> Floats:
    """(2, LEG_HYPOTHESES, 2, 3) of right and left leg: last, and as the other leg but on its own side."""
    hypotheses = np.empty((2, LEG_HYPOTHESES, 2, 3))
    for k in (0, 1):
        hypotheses[k, 0] = last[2 + k]
        twin = last[3 - k].copy()
        twin[:, 0] = last[2 + k][:, 0]
        hypotheses[k, 1] = twin / np.linalg.norm(twin, axis=1, keepdims=True)
    return hypotheses


def combination(hypotheses: Floats, index: int) -> Floats:
    """(2, 2, 3) directions of both limbs in the combination `index` of `hypothesis_scores`."""
    first, second = divmod(index % hypotheses.shape[1] ** 2, hypotheses.shape[1])
    return np.stack([hypotheses[0, first], hypotheses[1, second]])


def hypothesis_scores(fit: BodyFit, first: int, hypotheses: Floats) -> Floats:
    """(n * n,) log matching scores of limbs `first` and `first` + 1 in all combinations of `hypotheses` (2, n, 2, 3).

    Entry i * n + j: hypothesis i of the first limb and j of the second.  Restores the fit.
    """
    fit.cover_limb(first, REMOVE)
    fit.cover_limb(first + 1, REMOVE)
    scores = _scores(fit.position, first, hypotheses, fit.model, fit.image)
    fit.cover_limb(first, ADD)
    fit.cover_limb(first + 1, ADD)
    return scores


@kernel
def _scores(position: Floats, first: int, hypotheses: Floats, model: PersonSizes, image: CoverImage) -> Floats:
    count = hypotheses.shape[1]
    scores = np.empty(count * count)
    origins = np.empty((2, 3))
    for k in range(2):
        for row in range(3):
            origins[k, row] = position[row]
            for column in range(3):
                origins[k, row] += image.torso_to_world[row, column] * model.origins[first + k, column]
    one = LimbBody(origins[0], model.limbs[first], first >= 2)
    two = LimbBody(origins[1], model.limbs[first + 1], first >= 2)
    for i in range(count):
        cover_limb(hypotheses[0, i], one, image, ADD, image.totals)
        for j in range(count):
            totals = image.totals.copy()
            cover_limb(hypotheses[1, j], two, image, COUNT, totals)
            scores[i * count + j] = np.log(score_of_counts(totals[0], totals[1], totals[2]) + 1e-3)
        cover_limb(hypotheses[0, i], one, image, REMOVE, image.totals)
    return scores
