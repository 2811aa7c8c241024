"""Training of a prior; held-out motion chooses the number of regions.  [Hybrid IV, Fig. 4]"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from zenocap.common.arrays import Floats
from zenocap.common.body.coordinates import Coordinates
from zenocap.common.errors import UserError
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.prior.learning import LearnedRegions, error_of, learn
from zenocap.services.tracker.prior.model import Prior, PriorTraining, Reconstruction, reconstruct_poses
from zenocap.services.tracker.prior.sequences import (
    TrainingMotion,
    finite_runs,
    held_out,
    mirrored,
    resampled,
    rms_velocities,
)

UNKNOWN = PriorTraining((), (), 0, False, 0, (), (0.0, 0.0, 0.0))  # of a prior that is being made


@dataclass(frozen=True)
class TrainingPlan:
    """Settings of a training.  Raises UserError for values out of range.

    regions: None to choose.  dims: of the subspaces.  rate: frames per second.  mirror: add motions with left and right
    exchanged.
    """

    dims: int = 3
    rate: float = 60.0
    mirror: bool = True
    seed: int = 0
    regions: int | None = None
    candidates: tuple[int, ...] = p.REGION_CANDIDATES

    def __post_init__(self) -> None:
        if not 1 <= self.dims <= 10:
            raise UserError(f"dims = {self.dims}: allowed: 1 to 10")
        if not (np.isfinite(self.rate) and 1 <= self.rate <= 1000):
            raise UserError(f"rate = {self.rate}: allowed: 1 to 1000 frames per second")
        for regions in (*self.candidates, *([] if self.regions is None else [self.regions])):
            if not 1 <= regions <= 500:
                raise UserError(f"regions = {regions}: allowed: 1 to 500")


def train(
    coordinates: Coordinates,
    motions: Sequence[TrainingMotion],
    held: Sequence[TrainingMotion],
    plan: TrainingPlan,
    report: Callable[[int, int, str], None] = lambda *_: None,
) -> Prior:
    """Prior of `motions`.  held: motions on which the number of regions is chosen; without them stretches are held out.

    report: called with trainings done, their number, and the next one.  Raises UserError.
    """
    all_sequences = prepare(coordinates, motions, plan)
    if held:
        used, validation = all_sequences, prepare(coordinates, held, plan)
    else:
        used, validation = held_out(all_sequences, plan.rate)
    frames = sum(map(len, used))
    counts = sorted({*plan.candidates, *((plan.regions,) if plan.regions else ())})
    counts = [count for count in counts if count * p.MIN_FRAMES_PER_REGION <= frames]
    if not counts or (plan.regions and plan.regions not in counts):
        requested = plan.regions or min(plan.candidates)
        least = requested * p.MIN_FRAMES_PER_REGION
        raise UserError(f"{frames} training frames: allowed: {least} or more at {plan.rate:g}/s, for {requested} regions")
    found: list[tuple[Reconstruction, LearnedRegions]] = []
    total = len(counts) + (not held)
    for done, count in enumerate(counts):
        report(done, total, f"{count} regions")
        result = learn(used, count, plan.dims, np.random.default_rng((plan.seed, count)))
        errors = [error_of(result.regions, np.concatenate(sequences), plan.dims) for sequences in (used, validation)]
        found.append((Reconstruction(count, *errors), result))
    chosen = plan.regions or choose_regions([errors for errors, _ in found])
    result = next(result for errors, result in found if errors.regions == chosen)
    distances = _distances(_prior(coordinates, result, used, plan, UNKNOWN), validation)
    if not held:
        report(total - 1, total, f"{chosen} regions of all")
        result = learn(all_sequences, chosen, plan.dims, np.random.default_rng((plan.seed, chosen)))
    report(total, total, "done")
    training = PriorTraining(
        tuple(motion.name for motion in motions),
        tuple(motion.name for motion in held),
        sum(map(len, all_sequences)),
        plan.mirror,
        plan.seed,
        tuple(errors for errors, _ in found),
        distances,
    )
    return _prior(coordinates, result, all_sequences, plan, training)


def choose_regions(errors: Sequence[Reconstruction]) -> int:
    """Smallest number of regions whose held-out error is within REGION_TOLERANCE of the best."""
    # Paper (replaced): IV chooses M by the error on the training data; here on held-out motion.
    best = min(row.held for row in errors)
    return min(row.regions for row in errors if row.held <= (1 + p.REGION_TOLERANCE) * best)


def prepare(coordinates: Coordinates, motions: Sequence[TrainingMotion], plan: TrainingPlan) -> list[Floats]:
    """Sequences at the plan's rate, then the same mirrored.  Raises UserError."""
    sequences: list[Floats] = []
    for motion in motions:
        if motion.coordinates.ndim != 2 or motion.coordinates.shape[1] != coordinates.dimension:
            allowed = f"{coordinates.dimension} coordinates of {coordinates.anatomy.name}"
            raise UserError(f"{motion.name}: poses of shape {motion.coordinates.shape}: allowed: {allowed}")
        runs = [resampled(coordinates, run, motion.rate, plan.rate) for run in finite_runs(motion.coordinates)]
        if not any(len(run) > 1 for run in runs):
            raise UserError(f"{motion.name}: {len(motion.coordinates)} frames, no two with poses: allowed: two or more")
        sequences += [run for run in runs if len(run) > 1]
    # Paper (added): every motion also mirrored.
    if plan.mirror:
        sequences += [mirrored(coordinates, poses) for poses in sequences]
    return sequences


def _prior(
    coordinates: Coordinates, used: LearnedRegions, sequences: Sequence[Floats], plan: TrainingPlan, training: PriorTraining
) -> Prior:
    poses = np.concatenate(sequences)
    regions = used.regions
    bare = Prior(
        coordinates.anatomy.name,
        coordinates.names,
        plan.rate,
        regions.centres,
        np.ascontiguousarray(regions.vectors[:, :, : plan.dims]),
        np.ascontiguousarray(regions.spectrum[:, : plan.dims]),
        np.zeros(regions.centres.shape),
        used.transitions,
        np.bincount(used.labels, minlength=len(regions.centres)) / len(used.labels),
        rms_velocities(sequences, plan.rate),
        training,
    )
    left = (poses - reconstruct_poses(bare, poses)) ** 2
    for region in range(bare.regions):
        bare.residuals[region] = left[used.labels == region].mean(axis=0)
    return bare


def _distances(prior: Prior, validation: Sequence[Floats]) -> tuple[float, float, float]:
    """ERROR_PERCENTILES of the root mean square residual of held-out poses, radians."""
    poses = np.concatenate(validation)
    left = np.sqrt(np.mean((poses - reconstruct_poses(prior, poses)) ** 2, axis=1))
    middle, high, highest = (float(value) for value in np.percentile(left, p.ERROR_PERCENTILES))
    return middle, high, highest


def draw_errors(path: Path, prior: Prior) -> None:
    """Write a figure of the reconstruction error by number of regions, format by `path`'s suffix.  Raises OSError."""
    rows = prior.training.errors
    regions = [row.regions for row in rows]
    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(regions, np.degrees([row.training for row in rows]), "o-", label="training")
    axes.plot(regions, np.degrees([row.held for row in rows]), "s--", label="held out")
    axes.axvline(prior.regions, color="grey", linewidth=0.8, label=f"this prior: {prior.regions}")
    axes.set(xlabel="regions M", ylabel="reconstruction error, RMS (degrees)", ylim=(0, None))
    axes.set_title(", ".join(prior.training.motions[:3]) + (" ..." if len(prior.training.motions) > 3 else ""))
    axes.legend()
    figure.savefig(path, dpi=150)
