"""Silhouette of one person in a frame: subtraction, the person's region, refinement of its mask."""

import cv2
import numpy as np

from zenocap.common.arrays import Image, Labels, Mask
from zenocap.common.vision.background import Background
from zenocap.common.vision.foreground import foreground
from zenocap.common.vision.mask_refinement import Edges, refined
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.regions import keep_person, person_labels
from zenocap.common.vision.semantics import overrule
from zenocap.common.vision.silhouette import Extents, PersonSilhouette, SilhouetteOptions, describe


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
        labels, gain = foreground(background, frame, options.foreground)
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
