"""Confidence of limbs and heading: coefficients fitted to simulated people, and how often they are right for others.

    python -m benchmarks.confidence [--fit 4] [--check 4] [--headings 2] [--postures 15] [--jobs 2]

Two cameras at 160x120.  Every person performs the fifteen postures and the motions of the shared motion capture files (none
where these are missing), and stands in the T-pose at every 15 degrees.  A limb is right when elbow or knee, and wrist or
ankle, are within LIMB_ERROR_M of the true ones; a heading when its error is below 90 degrees.  The coefficients printed are
those of `services/tracker/parameters.py`; the table has those in use, on the people who were not used for the fit.
"""

import argparse
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from multiprocessing import Pool

import cv2
import numpy as np
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score

from benchmarks.clips import SHARED
from benchmarks.errors import JOINTS, frame_error
from benchmarks.headings import heading_film
from benchmarks.loop import tracker_film
from benchmarks.table import Cell, table
from benchmarks.takes import FPS, SMALL, CapturedTake, Film, Take, default_folder, film
from benchmarks.variants import MOTIONS
from zenocap.common.arrays import Bools, Floats
from zenocap.services.tracker.filter.confidence import FEATURES, LIMBS, heading_confidence, limb_confidence
from zenocap.services.tracker.parameters import LIMB_ERROR_M
from zenocap.services.tracker.states import Outcome
from zenocap.simulation.motion.posture_style import POSTURES

ENDS = (("RElbow", "RWrist"), ("LElbow", "LWrist"), ("RKnee", "RAnkle"), ("LKnee", "LAnkle"))  # of LIMBS
BINS = (0.0, 0.25, 0.5, 0.75, 0.9, 1.0)
REVERSED_DEG = 90.0
SIGNS = (1, -1, 1, -1)  # of FEATURES without the constant
Job = Take | CapturedTake | tuple[int, int]  # the last: person and heading in degrees

# One row per frame: features of every limb, whether it is right, toes, whether the heading is right.
Rows = tuple[Floats, Bools, Floats, Bools]


def rows_of(job: Job) -> Rows:
    cv2.setNumThreads(1)
    if isinstance(job, tuple):
        return _rows(heading_film(*job, SMALL), FPS)
    return _rows(film(job, default_folder()), job.fps)


def _rows(filmed: Film, fps: float) -> Rows:
    outcomes: dict[int, Outcome] = {}
    found = tracker_film(filmed, fps, observe=outcomes.__setitem__)
    features, right, toes, ahead = [], [], [], []
    for k in range(filmed.motion_from, len(filmed.truths)):
        true, outcome = filmed.truths[k], outcomes.get(k)
        if true is None or k not in found or outcome is None or outcome.limb_features is None or outcome.toes is None:
            continue
        error = frame_error(found[k], true)
        features.append(outcome.limb_features)
        right.append([all(error.joints[JOINTS.index(name)] < 1000 * LIMB_ERROR_M for name in ends) for ends in ENDS])
        toes.append(outcome.toes)
        ahead.append(error.yaw < REVERSED_DEG)
    shape = (len(features), len(LIMBS), len(FEATURES))
    return (
        np.array(features).reshape(shape), np.array(right, dtype=bool).reshape(-1, len(LIMBS)), np.array(toes),
        np.array(ahead, dtype=bool),
    )  # fmt: skip


def jobs_of(people: Sequence[int], headings: int, postures: int) -> list[Job]:
    """headings: number of these people who stand in the T-pose.  postures: number of postures of each."""
    motions = [SHARED / "motions" / f"cmu_{name}.bvh" for name in MOTIONS]
    jobs: list[Job] = [Take(seed, posture, 0) for seed in people for posture in POSTURES[:postures]]
    jobs += [CapturedTake(seed, motion) for seed in people for motion in motions if motion.exists()]
    return [*jobs, *((seed, heading) for seed in people[:headings] for heading in range(0, 360, 15))]


def together(every: Sequence[Rows]) -> Rows:
    features, right, toes, ahead = zip(*every, strict=True)
    return np.concatenate(features), np.concatenate(right), np.concatenate(toes), np.concatenate(ahead)


def coefficients(features: Floats, right: Bools, signs: Sequence[int]) -> list[float]:
    """Of the odds that `right` (n,) is true; features (n, m) with the constant first.

    signs: what each feature but the constant means for the odds; one that would have another sign is left out.
    """
    used = np.ones(len(signs), dtype=bool)
    while True:
        model = LogisticRegression(max_iter=2000).fit(features[:, 1:][:, used], right)
        found = np.zeros(len(signs))
        found[used] = model.coef_[0]
        if (found * signs >= 0.0).all():
            return [round(float(value), 2) for value in (model.intercept_[0], *found)]
        used &= found * signs >= 0.0


def reliability(name: str, predicted: Floats, right: Bools) -> list[Cell]:
    """Predicted and true frequency by BINS, and how well the confidence separates right from wrong."""
    cells: list[Cell] = []
    for low, high in pairwise(BINS):
        inside = (predicted >= low) & ((predicted < high) | (high == 1.0))
        shares = (
            f"{predicted[inside].mean():.2f} / {right[inside].mean():.2f} ({inside.mean():.0%})" if inside.any() else "–"
        )
        cells.append(shares)
    area = f"{roc_auc_score(right, predicted):.2f}" if 0 < right.mean() < 1 else "–"
    return [name, len(right), f"{right.mean():.3f}", *cells, area]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, default=4, help="people of the fit, from number 0 (default 4)")
    parser.add_argument("--check", type=int, default=4, help="people of the table, from number 24 (default 4)")
    parser.add_argument("--headings", type=int, default=2, help="of each, who stand in the T-pose (default 2)")
    parser.add_argument("--postures", type=int, default=len(POSTURES), help="of each person (default all)")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with Pool(options.jobs) as pool:
        collect = partial(pool.map, rows_of, chunksize=1)
        fit, check = range(options.fit), range(24, 24 + options.check)
        fitted = together(collect(jobs_of(fit, options.headings, options.postures)))
        checked = together(collect(jobs_of(check, options.headings, options.postures)))
    for name, limbs in (("ARM_CONFIDENCE", slice(0, 2)), ("LEG_CONFIDENCE", slice(2, 4))):
        features, right = fitted[0][:, limbs].reshape(-1, len(FEATURES)), fitted[1][:, limbs].reshape(-1)
        print(f"{name} = {tuple(coefficients(features, right, SIGNS))}")
    if not fitted[3].all():
        hundredths = np.stack([np.ones(len(fitted[2])), 100.0 * fitted[2]], axis=1)
        constant, slope = coefficients(hundredths, fitted[3], (1,))
        print(f"HEADING_CONFIDENCE = {(constant, round(100.0 * slope))}")
    predicted = np.array([limb_confidence(features) for features in checked[0]])
    rows = [
        reliability("arms", predicted[:, :2].ravel(), checked[1][:, :2].ravel()),
        reliability("legs", predicted[:, 2:].ravel(), checked[1][:, 2:].ravel()),
        reliability("heading", np.array([heading_confidence(toes) for toes in checked[2]]), checked[3]),
    ]
    ranges = [f"{low:g} to {high:g}" for low, high in pairwise(BINS)]
    columns = ("", "frames", "right", *ranges, "area under ROC")
    print(table("Predicted / true frequency (share of frames), people not used for the fit", columns, rows))


if __name__ == "__main__":
    main()
