"""Sudden change of the light: background model times a smooth map of gains."""

from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Image, Mask
from zenocap.common.vision.background import Background
from zenocap.common.vision.foreground import ForegroundOptions, foreground

FIT_STEP_PX, FIT_ROUNDS = 6, 8  # of the map of gains: grid of samples, rounds of reweighting; chosen by hand
FIT_SHARE = 0.6  # of the differing pixels that a map must explain; chosen by hand
FEWEST = 50  # samples; chosen by hand
LARGEST_LOG = 1.5  # of a gain; chosen by hand
SMALLEST_SPREAD = 0.005  # of the logarithms, for the weights; chosen by hand


def relit(
    background: Background, frame: Image, person: Mask | None, differing: int, options: ForegroundOptions
) -> Background | None:
    """The model in the light of the frame: multiplied by a smooth map of gains; None when no map explains the frame.

    The map is a polynomial of second degree of the logarithm of the ratio, for every channel, fitted to a grid of pixels by
    reweighted least squares (Cauchy weights).  differing: pixels of the frame that differ from the model.
    """
    height, width = frame.shape[:2]
    grid = np.s_[FIT_STEP_PX // 2 :: FIT_STEP_PX, FIT_STEP_PX // 2 :: FIT_STEP_PX]
    y, x = np.mgrid[0:height, 0:width]
    u, v = 2.0 * x / width - 1.0, 2.0 * y / height - 1.0
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)
    seen = cv2.blur(frame, (3, 3))[grid].astype(np.float64)
    known = cv2.blur(background.mean, (3, 3))[grid].astype(np.float64)
    usable = ((seen > 6) & (seen < 250) & (known > 6)).all(axis=-1)
    if person is not None:
        usable &= person[grid] == 0
    if np.count_nonzero(usable) < FEWEST:
        return None
    design, field = terms[grid][usable], np.empty(background.mean.shape, np.float32)
    for c in range(3):
        logs = np.log(seen[..., c][usable] / known[..., c][usable])
        weight = np.ones(len(logs))
        found = np.zeros(6)
        found[0] = np.median(logs)
        for _ in range(FIT_ROUNDS):
            rest = logs - design @ found
            scale = max(1.4826 * float(np.median(np.abs(rest))), SMALLEST_SPREAD)
            weight = 1.0 / (1.0 + (rest / (2.0 * scale)) ** 2)
            root = np.sqrt(weight)[:, None]
            found = np.linalg.lstsq(design * root, logs * root[:, 0], rcond=None)[0]
        field[..., c] = np.exp(np.clip(terms @ found, -LARGEST_LOG, LARGEST_LOG))
    changed = replace(background, mean=np.clip(background.mean * field, 0, 255).astype(np.float32))
    labels, _ = foreground(changed, frame, options)
    after = np.count_nonzero(labels)
    return changed if after < (1.0 - FIT_SHARE) * differing else None
