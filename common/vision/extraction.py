"""Silhouette of one person in a frame: subtraction, the person's region, refinement of its mask."""

from dataclasses import replace

import cv2
import numpy as np

from zenocap.common.arrays import Floats32, Image, Labels, Mask
from zenocap.common.vision.background import Background
from zenocap.common.vision.foreground import foreground
from zenocap.common.vision.mask_refinement import Edges, refined
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.regions import keep_person, person_labels
from zenocap.common.vision.semantics import overrule
from zenocap.common.vision.silhouette import Extents, PersonSilhouette, SilhouetteOptions, describe

HALO_RATE, HALO_MAX = 0.3, 6.0  # of a measurement, chosen on six coded films; largest, chosen by hand
HALO_INNER_PX, HALO_OUTER_PX = 3, 8  # px, ring in which the halo is measured: within a block of the compression
UPPER = 0.7  # of the height of a silhouette from the top, above the shadow; chosen by hand
HALO_QUANTILE, HALO_CHI = 0.9, 2.5003  # and the quantile of the chi distribution with three degrees of freedom


def extract(
    background: Background | Mixture,
    frame: Image,
    options: SilhouetteOptions,
    previous: Extents | None = None,
    decided: Mask | None = None,
) -> PersonSilhouette | None:
    """Silhouette of the person in a frame (height, width, 3) uint8 BGR; None when no region is large enough.

    previous: last extents of the person, for the choice "nearest".  decided: see `common.vision.semantics`.
    Pure for a `Background`; a `Mixture` learns from it.
    Raises ValueError when the frame's shape is not the background's.
    """
    edges = None
    if isinstance(background, Mixture):
        labels = background.foreground(frame)
    else:
        labels, gain = foreground(background, frame, options.foreground, background.halo)
        edges = Edges(frame, background.mean, background.weight, gain)
    if decided is not None:
        overrule(labels, decided)
    return clean(labels, options, previous, edges)


def clean(
    labels: Labels, options: SilhouetteOptions, previous: Extents | None = None, edges: Edges | None = None
) -> PersonSilhouette | None:
    """Silhouette in a label image (height, width) of `common.vision.foreground`; edges are trimmed when given."""
    kernel = 2 * round(max(0.0, options.crack * labels.shape[0] - 1) / 2) + 1
    if kernel > 1:
        labels = np.asarray(cv2.medianBlur(labels, 3), dtype=np.uint8)
    person = person_labels(labels, options, previous, kernel // 2 + 1)
    if person is None:
        return None
    inside, (left, top, right, bottom) = person
    place = np.s_[top:bottom, left:right]
    # Paper (replaced): 1 filters by morphology; here regions, small closings, holes by area, and edges by coverage.
    mask = refined(inside, options, kernel, None if edges is None else edges.within(place))
    if not keep_person(mask, labels[place], options):
        return None
    whole = np.zeros(labels.shape, dtype=np.uint8)
    whole[place] = mask
    return describe(whole, options.smallest, (left, top, right, bottom))


def with_halo(background: Background, frame: Image, gain: Floats32, silhouette: PersonSilhouette) -> Background:
    """The model with its running mean of the noise around the upper part of a silhouette, each time at most HALO_MAX.

    The ring from HALO_INNER_PX to HALO_OUTER_PX around it shows the room: distances from the model follow a chi
    distribution with three degrees of freedom where the noise is that of the model.  gain: (3,) of the frame.
    """
    e = silhouette.extents
    knee = e.highest + round(UPPER * (e.lowest - e.highest))
    pad = HALO_OUTER_PX + 1
    place = np.s_[max(0, e.highest - pad) : knee, max(0, e.leftmost - pad) : e.rightmost + pad]
    mask = silhouette.mask[place]
    inner = cv2.dilate(mask, np.ones((2 * HALO_INNER_PX + 1,) * 2, np.uint8))
    ring = (cv2.dilate(mask, np.ones((2 * HALO_OUTER_PX + 1,) * 2, np.uint8)) != 0) & (inner == 0)
    halo = 1.0
    if np.count_nonzero(ring) >= 50:
        off = frame[place][ring] - gain * background.mean[place][ring]
        distances = np.sqrt(np.sum(off * off * background.weight[place][ring], axis=1))
        halo = float(np.clip(np.quantile(distances, HALO_QUANTILE) / HALO_CHI, 1.0, HALO_MAX))
    return replace(background, halo=background.halo + HALO_RATE * (halo - background.halo))
