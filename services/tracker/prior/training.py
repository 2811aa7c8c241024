"""From motions to a prior: the number of regions is chosen on motion that was not learnt from.  [Hybrid IV, Fig. 4]"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from common.body.anatomy import Floats
from common.body.coordinates import Coordinates
from services.tracker.prior.learning import Learnt, error_of, learn
from services.tracker.prior.model import Prior, Reconstruction, Training, encoded
from services.tracker.prior.sequences import held_out, mirrored, resampled, speeds, whole_runs

CANDIDATES = (5, 10, 15, 20, 30, 40, 60, 80)
TOLERANCE = 0.05  # of the best held-out error, for fewer regions
FRAMES_A_REGION = 5  # at least; the paper's 20 regions were learnt from 100 frames
PERCENTILES = (50, 90, 99)


class MotionError(ValueError):
    """Motion that no prior can be learnt from; the text names what is wrong and what is allowed."""


@dataclass(frozen=True)
class Plan:
    """regions: None to choose.  dims: of the subspaces.  rate: frames per second.  mirror: learn left and right exchanged
    as well.  Raises MotionError when made with values out of range."""

    dims: int = 3
    rate: float = 60.0
    mirror: bool = True
    seed: int = 0
    regions: int | None = None
    candidates: tuple[int, ...] = CANDIDATES

    def __post_init__(self) -> None:
        if not 1 <= self.dims <= 10:
            raise MotionError(f"dims = {self.dims}: allowed: 1 to 10")
        if not (np.isfinite(self.rate) and 1 <= self.rate <= 1000):
            raise MotionError(f"rate = {self.rate}: allowed: 1 to 1000 frames per second")
        for regions in (*self.candidates, *([] if self.regions is None else [self.regions])):
            if not 1 <= regions <= 500:
                raise MotionError(f"regions = {regions}: allowed: 1 to 500")


@dataclass(frozen=True)
class Recording:
    """A motion of some file.  poses: (T, d) coordinates in radians, NaN where there is none.  rate: frames per second."""

    name: str
    rate: float
    poses: Floats


def train(
    coordinates: Coordinates,
    motions: Sequence[Recording],
    held: Sequence[Recording],
    plan: Plan,
    report: Callable[[int, int, str], None] = lambda done, of, words: None,
) -> Prior:
    """A prior of `motions`.  held: motions to choose the number of regions on; without them stretches are held out.

    report: is told how many trainings are done, of how many, and what comes next.  Raises MotionError.
    """
    everything = prepared(coordinates, motions, plan)
    if held:
        learnt, unseen = everything, prepared(coordinates, held, plan)
    else:
        learnt, unseen = held_out(everything, plan.rate)
    frames = sum(map(len, learnt))
    counts = sorted({count for count in (*plan.candidates, *((plan.regions,) if plan.regions else ())) if count})
    counts = [count for count in counts if count * FRAMES_A_REGION <= frames]
    if not counts or (plan.regions and plan.regions not in counts):
        wanted = plan.regions or min(plan.candidates)
        least = wanted * FRAMES_A_REGION
        raise MotionError(
            f"{frames} frames to learn from: allowed: {least} or more at {plan.rate:g}/s, for {wanted} regions"
        )
    found: list[tuple[Reconstruction, Learnt]] = []
    total = len(counts) + (not held)
    for done, count in enumerate(counts):
        report(done, total, f"{count} regions")
        result = learn(learnt, count, plan.dims, np.random.default_rng((plan.seed, count)))
        errors = [error_of(result.regions, np.concatenate(some), plan.dims) for some in (learnt, unseen)]
        found.append((Reconstruction(count, *errors), result))
    chosen = chosen_of([errors for errors, _ in found], plan.regions)
    result = next(result for errors, result in found if errors.regions == chosen)
    distances = _distances(_prior(coordinates, result, learnt, plan, _untold(motions)), unseen)
    if not held:
        report(total - 1, total, f"{chosen} regions of all")
        result = learn(everything, chosen, plan.dims, np.random.default_rng((plan.seed, chosen)))
    report(total, total, "done")
    training = Training(
        tuple(motion.name for motion in motions),
        tuple(motion.name for motion in held),
        sum(map(len, everything)),
        plan.mirror,
        plan.seed,
        tuple(errors for errors, _ in found),
        distances,
    )
    return _prior(coordinates, result, everything, plan, training)


def chosen_of(errors: Sequence[Reconstruction], wanted: int | None = None) -> int:
    """`wanted`, or the smallest number of regions whose held-out error is within TOLERANCE of the best."""
    if wanted is not None:
        return wanted
    best = min(row.held for row in errors)
    return min(row.regions for row in errors if row.held <= (1 + TOLERANCE) * best)


def prepared(coordinates: Coordinates, motions: Sequence[Recording], plan: Plan) -> list[Floats]:
    """Sequences at the plan's rate, then the same mirrored.  Raises MotionError."""
    sequences: list[Floats] = []
    for motion in motions:
        if motion.poses.ndim != 2 or motion.poses.shape[1] != coordinates.dimension:
            allowed = f"{coordinates.dimension} coordinates of {coordinates.anatomy.name}"
            raise MotionError(f"{motion.name}: poses of shape {motion.poses.shape}: allowed: {allowed}")
        runs = [resampled(coordinates, run, motion.rate, plan.rate) for run in whole_runs(motion.poses)]
        if not any(len(run) > 1 for run in runs):
            raise MotionError(f"{motion.name}: {len(motion.poses)} frames, no two with poses: allowed: two or more")
        sequences += [run for run in runs if len(run) > 1]
    if plan.mirror:
        sequences += [mirrored(coordinates, poses) for poses in sequences]
    return sequences


def _prior(coordinates: Coordinates, learnt: Learnt, sequences: Sequence[Floats], plan: Plan, training: Training) -> Prior:
    poses = np.concatenate(sequences)
    regions = learnt.regions
    bare = Prior(
        coordinates.anatomy.name,
        coordinates.names,
        plan.rate,
        regions.centres,
        np.ascontiguousarray(regions.vectors[:, :, : plan.dims]),
        np.ascontiguousarray(regions.spectrum[:, : plan.dims]),
        np.zeros(regions.centres.shape),
        learnt.transitions,
        np.bincount(learnt.labels, minlength=len(regions.centres)) / len(learnt.labels),
        speeds(sequences, plan.rate),
        training,
    )
    left = (poses - encoded(bare, poses)) ** 2
    for region in range(bare.regions):
        bare.residuals[region] = left[learnt.labels == region].mean(axis=0)
    return bare


def _distances(prior: Prior, unseen: Sequence[Floats]) -> tuple[float, float, float]:
    """PERCENTILES of the root mean square residual of poses that were not learnt from, radians."""
    poses = np.concatenate(unseen)
    left = np.sqrt(np.mean((poses - encoded(prior, poses)) ** 2, axis=1))
    middle, high, highest = (float(value) for value in np.percentile(left, PERCENTILES))
    return middle, high, highest


def _untold(motions: Sequence[Recording]) -> Training:
    return Training(tuple(motion.name for motion in motions), (), 0, False, 0, (), (0.0, 0.0, 0.0))
