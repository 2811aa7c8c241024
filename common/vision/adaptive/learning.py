"""Learning of the adaptive model by pixel: visits of rows, and candidates that become the mean."""

import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.jit import kernel, leaf_kernel
from zenocap.common.vision.foreground import BACKGROUND

STRIDE = 8  # frames in which every row is visited once; chosen by hand
MEAN_RATE = 0.05  # share of the difference that a visit takes over; chosen by hand
CANDIDATE_RATE = 0.25  # of a candidate's colour; chosen by hand
SAME_SIGMAS = 4.5  # of the typical noise, a channel's change that ends a candidate; chosen by hand
SAME_SHARE = 0.02  # of the brightness, added to that; chosen by hand
STILL_S, FAINT_S = 0.7, 4.0  # s without a change before a pixel is learnt; FAINT_S in small regions; chosen by hand
NEVER, LEARN, LATER = 0, 1, 2  # verdicts on a pixel that differs: person, learnt after STILL_S, after FAINT_S


@kernel
def visit(
    frame: Image,
    labels: Labels,
    held: Mask,
    gain: Floats32,
    mean: Floats32,
    candidate: Floats32,
    since: Floats32,
    now_s: np.float32,
    same: np.float32,
    first: int,
) -> None:
    """Visit every STRIDE-th row from `first`, in place."""
    height, width = labels.shape
    gains, value = np.empty(3 * width, dtype=np.float32), np.empty(3 * width, dtype=np.float32)
    near = np.empty(3 * width, dtype=np.uint8)
    candidate_rate, mean_rate = np.empty(3 * width, dtype=np.float32), np.empty(3 * width, dtype=np.float32)
    for x in range(width):
        gains[3 * x], gains[3 * x + 1], gains[3 * x + 2] = gain[0], gain[1], gain[2]
    for y in range(first, height, STRIDE):
        _compare(frame[y].reshape(-1), gains, candidate[y].reshape(-1), same, value, near)
        for x in range(width):
            is_near = near[3 * x] & near[3 * x + 1] & near[3 * x + 2] != 0
            if not is_near:
                since[y, x] = now_s
            learns = labels[y, x] == BACKGROUND and held[y, x] == 0
            candidate_rate[3 * x : 3 * x + 3] = np.float32(CANDIDATE_RATE if is_near else 1)
            mean_rate[3 * x : 3 * x + 3] = np.float32(MEAN_RATE if learns else 0)
        _approach(candidate[y].reshape(-1), value, candidate_rate)
        _approach(mean[y].reshape(-1), value, mean_rate)


@leaf_kernel
def _compare(row: Image, gains: Floats32, candidate: Floats32, same: np.float32, value: Floats32, near: Image) -> None:
    """Of each channel of a row (n,): the value in the light of the model, and 1 where the candidate is near it, else 0."""
    for k in range(len(row)):
        value[k] = np.float32(row[k]) / gains[k]
        near[k] = abs(value[k] - candidate[k]) <= same + np.float32(SAME_SHARE) * value[k]


@leaf_kernel
def _approach(known: Floats32, value: Floats32, rate: Floats32) -> None:
    """Move each known value (n,) by a share of its difference from the value seen, in place."""
    for k in range(len(known)):
        known[k] += rate[k] * (value[k] - known[k])


@kernel
def learn_still(
    frame: Image,
    labels: Labels,
    learnt: Mask,
    gain: Floats32,
    mean: Floats32,
    candidate: Floats32,
    since: Floats32,
    now_s: np.float32,
    same: np.float32,
) -> None:
    """Take the candidate for the mean where it is still seen and has been for long enough, in place."""
    height, width = labels.shape
    for y in range(height):
        for x in range(width):
            if labels[y, x] == BACKGROUND or learnt[y, x] == NEVER:
                continue
            if now_s - since[y, x] < np.float32(STILL_S if learnt[y, x] == LEARN else FAINT_S):
                continue
            near = True
            for c in range(3):
                value = np.float32(frame[y, x, c]) / gain[c]
                near = near and abs(value - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value
            if near:
                labels[y, x] = BACKGROUND
                for c in range(3):
                    mean[y, x, c] = candidate[y, x, c]
