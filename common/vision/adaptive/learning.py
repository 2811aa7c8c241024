"""What the adaptive model learns pixel by pixel: visits of rows, and candidates that become the mean."""

import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.jit import kernel
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
    value = np.empty(3, dtype=np.float32)
    for y in range(first, height, STRIDE):
        for x in range(width):
            near = True
            for c in range(3):
                value[c] = np.float32(frame[y, x, c]) / gain[c]
                near = near and abs(value[c] - candidate[y, x, c]) <= same + np.float32(SAME_SHARE) * value[c]
            if not near:
                since[y, x] = now_s
            rate = np.float32(CANDIDATE_RATE) if near else np.float32(1)
            for c in range(3):
                candidate[y, x, c] += rate * (value[c] - candidate[y, x, c])
            if labels[y, x] == BACKGROUND and held[y, x] == 0:
                for c in range(3):
                    mean[y, x, c] += np.float32(MEAN_RATE) * (value[c] - mean[y, x, c])


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
