"""The modified particle filter: selection, sampling in the prior's subspace, refinement, weighting.  [Hybrid V-A]

Chance is an argument: everything random is drawn by `draw` from one generator.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from common.body.anatomy import Floats
from common.body.rotation_vectors import rotation_of
from services.tracker.closest import Singles
from services.tracker.model import Ints, Model
from services.tracker.prior.sampling import assign, propose
from services.tracker.prior.tables import Tables
from services.tracker.refine import Weights, misfit_of
from services.tracker.refinements import refine_by
from services.tracker.room import Room

DYNAMIC, PRIOR = 0, 1


class Cloud(NamedTuple):
    """n particles: positions (n, 3), rotations (n, 3, 3), values (n, d), regions (n,), weights (n,) that sum to 1."""

    positions: Floats
    rotations: Floats
    values: Floats
    regions: Ints
    weights: Floats


class Draws(NamedTuple):
    """What chance decides of one step.  chosen: (n,) the particle that each comes from.  kinds: (n,) DYNAMIC or PRIOR.

    noise: (n, 6 + d) standard normal.  uniforms: (n,) in [0, 1).  normals: (n, m) standard normal, in the subspace.
    """

    chosen: Ints
    kinds: Ints
    noise: Floats
    uniforms: Floats
    normals: Floats


def draw(cloud: Cloud, prior_share: float, subspace: int, rng: np.random.Generator) -> Draws:
    """Selection by weight, and all the numbers that sampling needs; the share of proposals that come from the prior.

    The first particle is the heaviest one, moved on without noise.
    """
    n, d = cloud.values.shape
    steps = (np.arange(n) + rng.uniform()) / n  # systematic: as few lost as can be
    chosen = np.minimum(np.searchsorted(np.cumsum(cloud.weights), steps), n - 1).astype(np.int64)
    kinds = np.where(rng.permutation(n) < round(prior_share * n), PRIOR, DYNAMIC).astype(np.int64)
    noise = rng.standard_normal((n, 6 + d))
    chosen[0], kinds[0], noise[0] = int(np.argmax(cloud.weights)), DYNAMIC, 0.0
    return Draws(chosen, kinds, noise, np.asarray(rng.uniform(size=n)), rng.standard_normal((n, subspace)))


def everywhere(positions: Floats, rotations: Floats, values: Floats) -> Cloud:
    """Particles of equal weight."""
    n = len(positions)
    return Cloud(positions, rotations, values, np.zeros(n, dtype=np.int64), np.full(n, 1.0 / n))


def weighted(errors: Floats, contrast: float) -> Floats:
    """(n,) weights exp(-D / sigma^2) that sum to 1, from errors D in m^2; contrast: 1 / sigma^2.  [Hybrid Eq. 29]"""
    weights = np.exp(-(errors - errors.min()) * contrast)
    result: Floats = weights / weights.sum()
    return result


@njit(cache=True, error_model="numpy", parallel=True)
def advance(
    model: Model,
    tables: Tables,
    has_prior: bool,
    rays: Singles,
    room: Room,
    weights: Weights,
    refinement: int,
    iterations: int,
    cloud: Cloud,
    draws: Draws,
    velocity: Floats,
    deviations: Floats,
    out: Cloud,
    errors: Floats,
) -> None:
    """Sample, refine and judge every particle: out's arrays and errors (n,), D in m^2, are overwritten.

    refinement: index in REFINEMENTS.
    velocity: (6 + d,) change since the last instant, expected again.  deviations: (6 + d,) of the dynamic proposals.
    """
    n, d = cloud.values.shape
    regions = out.regions  # numba drops a store into a tuple's array from a parallel loop
    for k in prange(n):
        source = draws.chosen[k]
        position, rotation, values = out.positions[k], out.rotations[k], out.values[k]
        vector, turn = np.empty(3), np.empty((3, 3))
        for i in range(3):
            position[i] = cloud.positions[source, i] + velocity[i] + deviations[i] * draws.noise[k, i]
            vector[i] = velocity[3 + i] + deviations[3 + i] * draws.noise[k, 3 + i]
        rotation_of(vector, turn)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for m in range(3):
                    total += turn[i, m] * cloud.rotations[source, m, j]
                rotation[i, j] = total
        region = cloud.regions[source]
        if draws.kinds[k] == PRIOR and has_prior:
            region = propose(tables, region, cloud.values[source], draws.uniforms[k], draws.normals[k], 1.0, values)
        else:
            for i in range(d):
                values[i] = cloud.values[source, i] + velocity[6 + i] + deviations[6 + i] * draws.noise[k, 6 + i]
        for i in range(d):
            values[i] = min(max(values[i], model.low[i]), model.high[i])
        if iterations > 0:
            refine_by(
                refinement, model, rays, room, weights, iterations, position, rotation, values,
                position.copy(), rotation.copy(), values.copy(),
            )  # fmt: skip
            if has_prior:
                region = assign(tables, values)
        regions[k] = region
        errors[k] = misfit_of(model, rays, room, weights.limit, position, rotation, values)


NO_TABLES = Tables(np.zeros((1, 1)), np.zeros((1, 1, 1)), np.ones((1, 1)), np.ones((1, 1)), np.ones(1), np.zeros(1))
