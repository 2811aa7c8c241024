"""Priors with known parameters, and motion drawn from them."""

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.coordinates import coordinates_of
from zenocap.services.tracker.prior.model import Prior, PriorTraining, Reconstruction, reconstruct_poses

COORDINATES = coordinates_of(FOURTEEN_PARTS)
D = COORDINATES.dimension
TRAINING = PriorTraining(("made.bvh",), (), 100, False, 0, (Reconstruction(4, 0.02, 0.03),), (0.01, 0.02, 0.03))


def known_prior(seed: int = 0, regions: int = 4, dims: int = 3, stay: float = 0.8) -> Prior:
    """Regions about one radian apart, in a ring: a frame stays in its region or goes to the next."""
    rng = np.random.default_rng(seed)
    bases = np.stack([np.linalg.qr(rng.normal(size=(D, dims)))[0] for _ in range(regions)])
    following = np.roll(np.eye(regions), 1, axis=1)
    return Prior(
        COORDINATES.anatomy.name, COORDINATES.names, 60.0, rng.normal(scale=0.4, size=(regions, D)), bases,
        np.tile(np.linspace(0.3, 0.1, dims) ** 2, (regions, 1)), np.full((regions, D), np.radians(0.5) ** 2),
        stay * np.eye(regions) + (1 - stay) * following, np.full(regions, 1.0 / regions), np.full(D, 0.5), TRAINING,
    )  # fmt: skip


def drawn(prior: Prior, frames: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Poses (frames, d) in radians drawn from a prior, and their regions (frames,)."""
    poses, regions = np.empty((frames, D)), np.empty(frames, dtype=np.int64)
    region = 0
    for t in range(frames):
        region = int(rng.choice(prior.regions, p=prior.transitions[region]))
        z = rng.normal(size=prior.dimensions) * np.sqrt(prior.variances[region])
        noise = rng.normal(size=D) * np.sqrt(prior.residuals[region])
        poses[t], regions[t] = prior.centres[region] + prior.bases[region] @ z + noise, region
    return poses, regions


def gait(frames: int, seed: int = 0, cadence: float = 6.0) -> Floats:
    """(frames, d) periodic, smooth motion at 60 frames per second: a closed curve in six dimensions."""
    rng = np.random.default_rng(seed)
    directions = np.random.default_rng(99).normal(scale=0.25, size=(6, D))
    phase = cadence * np.arange(frames) / 60 + rng.uniform(0, 6)
    curve = [np.sin(phase), np.cos(phase), np.sin(2 * phase), np.cos(2 * phase), 0.3 * np.sin(3 * phase), 0.1 * phase / 6]
    return np.stack(curve, axis=1) @ directions + rng.normal(scale=0.005, size=(frames, D))


def reconstruction_error(prior: Prior, poses: Floats) -> float:
    """Root mean square over frames and coordinates of poses (T, d) less their reconstructions, radians."""
    return float(np.sqrt(np.mean((poses - reconstruct_poses(prior, poses)) ** 2)))
