"""Outline of the mask: odd kernels, enclosed regions, holes and edges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from zenocap.common.arrays import Floats, Mask
from zenocap.common.vision.foreground import BACKGROUND, STRONG, UNSURE
from zenocap.common.vision.mask_refinement import close_cracks, enclosed, odd_kernel, trim_edges
from zenocap.common.vision.regions import fill_holes

MASKS = arrays(np.uint8, (20, 24), elements=st.integers(0, 1))


@pytest.mark.parametrize("size", [0, 2, 4, -3])
def test_even_kernels_are_refused(size: int) -> None:
    with pytest.raises(ValueError, match="allowed are odd numbers from 1"):
        odd_kernel(size)


@given(MASKS, st.sampled_from([1, 3, 5, 7]))
def test_closing_is_symmetric(mask: Mask, size: int) -> None:
    for turn in (np.flipud, np.fliplr):
        turned = np.ascontiguousarray(turn(mask))
        assert np.array_equal(close_cracks(turned, size), turn(close_cracks(mask, size)))


@given(MASKS, st.sampled_from([3, 5]))
def test_closing_only_adds_pixels_and_is_idempotent(mask: Mask, size: int) -> None:
    once = close_cracks(mask, size)
    assert np.all(once >= mask)
    assert np.array_equal(close_cracks(once, size), once)


def test_closing_does_not_move_a_box() -> None:
    mask = np.zeros((20, 20), dtype=np.uint8)
    mask[6:14, 5:12] = 1
    assert np.array_equal(close_cracks(mask, 5), mask)


def test_small_holes_are_filled_and_large_ones_kept() -> None:
    mask = np.ones((20, 20), dtype=np.uint8)
    mask[3:5, 3:5] = 0
    mask[8:14, 8:14] = 0
    mask[0, 10] = 0  # open to the outside
    fill_holes(mask, 4)
    assert np.all(mask[3:5, 3:5] == 1)
    assert np.all(mask[8:14, 8:14] == 0)
    assert mask[0, 10] == 0


# Boxes of strong and unsure pixels, those that are in the mask, and those that are not.
ENCLOSED = {
    "clothes between shirt and shoes, a shadow beside them": (
        [np.s_[2:8, 8:12], np.s_[16:18, 8:12]], [np.s_[8:16, 8:12], np.s_[17:19, 1:8]], np.s_[2:18, 8:12], np.s_[17:19, 1:8]
    ),
    "sleeve between torso and hand": (
        [np.s_[4:18, 4:8], np.s_[5:7, 16:18]], [np.s_[5:7, 8:16]], np.s_[5:7, 8:18], np.s_[:, 18:]
    ),
    "patch between two feet": (
        [np.s_[17:19, 3:6], np.s_[17:19, 12:15]], [np.s_[17:19, 6:12]], np.s_[17:19, 3:6], np.s_[:, 6:12]
    ),
}  # fmt: skip


@pytest.mark.parametrize(("strong", "unsure", "within", "without"), ENCLOSED.values(), ids=ENCLOSED)
def test_unsure_pixels_between_strong_ones_are_added(strong: list, unsure: list, within: tuple, without: tuple) -> None:
    labels = np.full((20, 30), BACKGROUND, dtype=np.uint8)
    for boxes, label in ((strong, STRONG), (unsure, UNSURE)):
        for box in boxes:
            labels[box] = label
    mask = enclosed(labels, 0.7)
    assert np.all(mask[within] == 1)
    assert not mask[without].any()


def _trimmed(mask: Mask, coverage: Floats) -> Mask:
    """A person of grey value 40 that covers this fraction of each pixel of a wall of 150."""
    mean = np.full((*coverage.shape, 3), 150, dtype=np.float32)
    frame = np.rint(150 + (40 - 150) * coverage[..., None] + np.zeros(3)).astype(np.uint8)
    return np.asarray(trim_edges(mask, frame, mean, np.ones_like(mean), np.ones(3, dtype=np.float32), 0.5))


@given(st.floats(0, 1))
def test_edges_are_cut_at_the_given_coverage(share: float) -> None:
    coverage = np.zeros((12, 12))
    coverage[3:9, 4:9] = 1
    coverage[3:9, 3] = share
    mask = np.zeros((12, 12), dtype=np.uint8)
    mask[3:9, 3:9] = 1
    trimmed = _trimmed(mask, coverage)
    if abs(share - 0.5) > 0.05:
        assert np.all(trimmed[4:8, 3] == (share > 0.5))
    assert np.all(trimmed[4:8, 4:8] == 1)


@pytest.mark.parametrize("rows", [{4: 0.4}, {4: 0.9, 5: 0.2}, {4: 0.2, 5: 0.9}])
def test_a_limb_one_or_two_pixels_wide_survives_trimming(rows: dict[int, float]) -> None:
    coverage = np.zeros((9, 20))
    for row, share in rows.items():
        coverage[row, 2:18] = share
    trimmed = _trimmed((coverage > 0).astype(np.uint8), coverage)
    assert all(np.all(trimmed[row, 4:16] == 1) for row in rows)
