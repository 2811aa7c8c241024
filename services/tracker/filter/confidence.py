"""Confidence of limbs and heading (logistic): features of what the silhouettes show.

`python -m benchmarks confidence` compares predicted with true frequencies.
"""

# Paper (added): [Hybrid] gives no confidence.

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, frames_of
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.filter.limb_search import limb_support, limbs_of

LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")  # in the order of `limbs_of`
LEGS = slice(2, 4)  # of LIMBS
FEATURES = ("constant", "support ratio", "ln misfit", "body support ratio", "ambiguity")
MAX_RATIO = 1.2
MIN_MISFIT = 1e-6  # m^2
LEAST_SUPPORT = 1e-6
MAX_DISTANCE_M = 0.5


class Confidence(NamedTuple):
    """Probabilities to be right.  limbs: of LIMBS by name, empty where unknown.  heading: None where unknown."""

    limbs: dict[str, float]
    heading: float | None


def limb_features(
    anatomy: Anatomy, model: BodyModel, evidence: Evidence, pose: RootedPose,
    usual: Floats | None, expected_support: float, ambiguous: Floats, before: Floats | None = None,
) -> Floats:  # fmt: skip
    """(4, features) of LIMBS, running mean.  usual: (4,) usual support of the limbs, None at the start.

    expected_support: of the body.  ambiguous: (4,) see `ambiguity`.  before: features of the frame before, None without.
    """
    support = limb_support(anatomy, model, evidence, pose)
    error = float(misfit(model, evidence, p.RESIDUAL_LIMIT_M, pose))
    body = support_fraction(model, evidence, pose) / max(expected_support, LEAST_SUPPORT)
    features = np.ones((len(LIMBS), len(FEATURES)))
    if usual is not None:
        features[:, 1] = np.minimum(support / np.maximum(usual, LEAST_SUPPORT), MAX_RATIO)
    features[:, 2] = np.log(max(error, MIN_MISFIT))
    features[:, 3] = body
    features[:, 4] = ambiguous
    return smoothed_features(before, features)


def limb_points(anatomy: Anatomy, model: BodyModel, pose: RootedPose) -> Floats:
    """(2, 4, 3) middle and end of every limb, metres in the world."""
    lower = [limb.parts[1] for limb in limbs_of(anatomy)]
    frames = frames_of(model, pose)[lower]
    return np.stack([frames[:, :, 3], frames[:, :, 3] + model.lengths[lower, None] * frames[:, :, 1]])


def limb_distances(anatomy: Anatomy, model: BodyModel, poses: Sequence[RootedPose], from_pose: RootedPose) -> Floats:
    """(n, 4) mean distance in metres of the middle and the end of every limb in n poses from those in another pose."""
    points = np.array([limb_points(anatomy, model, pose) for pose in (from_pose, *poses)])
    distances: Floats = np.linalg.norm(points[1:] - points[0], axis=3).mean(axis=1)
    return distances


def ambiguity(distances: Floats, errors: Floats, least: float) -> Floats:
    """(4,) how far the limbs of other poses are that fit about as well, metres.

    distances: (n, 4) of other poses, see `limb_distances`.  errors: (n,) their misfits, m^2.  least: that of the best.
    """
    weights = np.exp(-(errors / max(least, MIN_MISFIT) - 1.0) / p.AMBIGUITY_SCALE)
    found: Floats = weights @ np.minimum(distances, MAX_DISTANCE_M) / (1.0 + weights.sum())
    return found


def smoothed_features(before: Floats | None, now: Floats) -> Floats:
    """Running mean of features; before: None in the first frame."""
    return now if before is None else before + p.LIMB_FEATURES_RATE * (now - before)


def confidences(features: Floats | None, toes: float | None, against: float = -np.inf) -> Confidence:
    """Confidence of the limbs, unknown without features, and of the heading, unknown without toes."""
    limbs = {} if features is None else dict(zip(LIMBS, limb_confidence(features).tolist(), strict=True))
    return Confidence(limbs, None if toes is None else heading_confidence(toes, against))


def limb_confidence(features: Floats) -> Floats:
    """(4,) probability that elbow or knee, and wrist or ankle, are within 0.15 m of the person's."""
    coefficients = np.array([p.ARM_CONFIDENCE, p.ARM_CONFIDENCE, p.LEG_CONFIDENCE, p.LEG_CONFIDENCE])
    return _logistic(np.sum(coefficients * features, axis=1))


def heading_confidence(toes: float, against: float = -np.inf) -> float:
    """Probability that the heading is right, by the feet and by its rivals, the less one.

    toes: forward reach of the feet (statures).  against: log odds of a rival of the heading.
    """
    odds = min(p.HEADING_CONFIDENCE[0] + p.HEADING_CONFIDENCE[1] * toes, -against)
    return float(_logistic(np.array([odds]))[0])


def _logistic(x: Floats) -> Floats:
    values: Floats = 1.0 / (1.0 + np.exp(-x))
    return values
