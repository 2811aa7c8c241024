"""Regions against OpenCV's labelling, and the gaps between them."""

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from zenocap.common.vision.regions import distance, find_regions, paint, reachable

LABELS = arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=24), elements=st.integers(0, 4))
Labels = np.ndarray[tuple[int, int], np.dtype[np.uint8]]


@given(LABELS, st.booleans())
def test_regions_equal_those_of_opencv(labels: Labels, diagonal: bool) -> None:
    regions = find_regions(labels, 2, 4, 4, diagonal)
    count, image, stats, _ = cv2.connectedComponentsWithStats(
        (labels >= 2).astype(np.uint8), connectivity=8 if diagonal else 4
    )
    assert len(regions.areas) == count - 1
    for k in range(count - 1):
        painted = np.zeros(labels.shape, dtype=np.uint8)
        paint(regions, np.arange(count - 1) == k, 1, painted)
        label = image[painted > 0][0]
        assert np.array_equal(painted > 0, image == label)
        left, top, width, height, area = stats[label]
        assert tuple(regions.boxes[k]) == (left, top, left + width, top + height)
        assert regions.areas[k] == area
        assert regions.seeds[k] == np.count_nonzero(labels[image == label] == 4)


@given(LABELS)
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
    assert distance(regions, 0, 1, 100) == apart


def test_regions_are_joined_step_by_step_within_the_distance() -> None:
    labels = np.zeros((5, 40), dtype=np.uint8)
    for first in (0, 10, 20, 33):
        labels[1:4, first : first + 8] = 4
    regions = find_regions(labels, 1, 4, 4, True)
    assert reachable(regions, 0, 2, 4).tolist() == [True, True, True, False]
    assert reachable(regions, 0, 2, 100).tolist() == [True, False, False, False]


def test_regions_without_a_seed_are_not_joined() -> None:
    labels = np.zeros((3, 20), dtype=np.uint8)
    labels[:, :5], labels[:, 7:12] = 4, 3
    assert reachable(find_regions(labels, 1, 4, 4, True), 0, 3, 1).tolist() == [True, False]
