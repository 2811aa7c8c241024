"""Regions against OpenCV's labelling, and the gaps between them."""

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from common.vision.regions import find_regions, gap, joined, paint

LABELS = arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=24), elements=st.integers(0, 4))
Labels = np.ndarray[tuple[int, int], np.dtype[np.uint8]]


@given(LABELS, st.booleans())
@settings(deadline=None)  # the first example compiles
def test_regions_are_those_of_opencv(labels: Labels, diagonal: bool) -> None:
    regions = find_regions(labels, 2, 4, 4, diagonal)
    count, image, stats, _ = cv2.connectedComponentsWithStats(
        (labels >= 2).astype(np.uint8), connectivity=8 if diagonal else 4
    )
    assert len(regions.areas) == count - 1
    for k in range(count - 1):
        painted = np.zeros(labels.shape, dtype=np.uint8)
        paint(regions, np.arange(count - 1) == k, 1, painted)
        theirs = image[painted > 0][0]
        assert np.array_equal(painted > 0, image == theirs)
        left, top, width, height, area = stats[theirs]
        assert tuple(regions.boxes[k]) == (left, top, left + width, top + height)
        assert regions.areas[k] == area
        assert regions.seeds[k] == np.count_nonzero(labels[image == theirs] == 4)


@given(LABELS)
@settings(deadline=None)  # the first example compiles
def test_gap_is_the_chessboard_distance_less_one(labels: Labels) -> None:
    regions = find_regions(labels, 3, 4, 4, True)
    if len(regions.areas) < 2:
        assert len(regions.areas) <= 1
        return
    places = []
    for k in (0, 1):
        painted = np.zeros(labels.shape, dtype=np.uint8)
        paint(regions, np.arange(len(regions.areas)) == k, 1, painted)
        places.append(np.argwhere(painted))
    apart = np.abs(places[0][:, None] - places[1][None]).max(axis=2).min() - 1
    assert gap(regions, 0, 1, 100) == apart


def test_joining_goes_from_piece_to_piece() -> None:
    labels = np.zeros((5, 40), dtype=np.uint8)
    for first in (0, 10, 20, 33):
        labels[1:4, first : first + 8] = 4
    regions = find_regions(labels, 1, 4, 4, True)
    assert joined(regions, 0, 2, 4).tolist() == [True, True, True, False]
    assert joined(regions, 0, 2, 100).tolist() == [True, False, False, False]


def test_pieces_without_a_seed_are_not_joined() -> None:
    labels = np.zeros((3, 20), dtype=np.uint8)
    labels[:, :5], labels[:, 7:12] = 4, 3
    assert joined(find_regions(labels, 1, 4, 4, True), 0, 3, 1).tolist() == [True, False]
