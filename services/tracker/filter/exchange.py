"""Exchange of left and right: the pose with the arms, or the legs, exchanged, tried against the tracked one.

From the side, a limb in front of the body is that of either side.  A wrong choice stays: each particle has made it, and
the exchanged pose is too far for them.  The exchanged pose is therefore refined in every frame, and replaces the tracked
one when it has fitted better over several frames.
"""

# Paper (added): [Hybrid V] does not try other poses.

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.filter.correspondence import misfit
from zenocap.services.tracker.filter.gauss_newton import refine
from zenocap.services.tracker.filter.particles import RefinementScene
from zenocap.services.tracker.parameters import EXCHANGE_ITERATIONS, EXCHANGE_MIN_ANGLE, EXCHANGE_RATE
from zenocap.services.tracker.prior.sequences import mirrored

PAIRS = ("arms", "legs")
JOINTS = {"arms": ("shoulder", "elbow", "wrist"), "legs": ("hip", "knee", "ankle")}


class Exchange(NamedTuple):
    """The best exchanged pose, and what it gains: (pairs,) running means of ln(misfit / misfit exchanged)."""

    gains: Floats
    pose: RootedPose | None


@lru_cache
def columns_of(anatomy: Anatomy) -> tuple[Ints, ...]:
    """Coordinates of both limbs of each of PAIRS."""
    names = coordinates_of(anatomy).names
    return tuple(
        np.array([k for k, name in enumerate(names) if name.partition("_")[2].partition(".")[0] in JOINTS[pair]])
        for pair in PAIRS
    )


def exchanged(anatomy: Anatomy, pose: RootedPose, pair: int) -> RootedPose:
    """The pose with the limbs of a pair exchanged; everything else as it is."""
    columns, values = columns_of(anatomy)[pair], pose.values.copy()
    values[columns] = mirrored(coordinates_of(anatomy), pose.values[None])[0, columns]
    return RootedPose(pose.position.copy(), pose.rotation.copy(), values)


def try_exchanges(anatomy: Anatomy, scene: RefinementScene, pose: RootedPose, gains: Floats) -> Exchange:
    """One more frame of the gains; pose: that of the pair with the largest gain, None while its limbs are alike."""
    error = misfit(scene.model, scene.rays, scene.field, scene.weights.limit, pose)
    after, trials = (1.0 - EXCHANGE_RATE) * gains, [exchanged(anatomy, pose, pair) for pair in range(len(PAIRS))]
    differ = [
        float(np.abs(trial.values[columns] - pose.values[columns]).max()) >= EXCHANGE_MIN_ANGLE
        for trial, columns in zip(trials, columns_of(anatomy), strict=True)
    ]
    for pair, trial in enumerate(trials):
        if differ[pair]:
            refine(scene.model, scene.rays, scene.field, scene.weights, EXCHANGE_ITERATIONS, trial, trial.copy())
            other = misfit(scene.model, scene.rays, scene.field, scene.weights.limit, trial)
            after[pair] += EXCHANGE_RATE * float(np.log(max(error, 1e-9) / max(other, 1e-9)))
    best = int(np.argmax(after))
    return Exchange(after, trials[best] if differ[best] else None)
