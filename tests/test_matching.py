"""The matching score of [Two-view Eq. 1]."""

from math import exp

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from common.vision.matching import matching_score
from common.vision.model_image import score_of

MASKS = arrays(np.uint8, (6, 7), elements=st.integers(0, 1))
Mask = NDArray[np.uint8]


def test_equation_1_by_hand() -> None:
    silhouette, model = np.zeros((4, 5), np.uint8), np.zeros((4, 5), np.uint8)
    silhouette[0, :4] = 1
    model[0, 1:] = 1  # three in both, one only here, one only there: p = n = 1/5
    assert matching_score(silhouette, model) == pytest.approx(exp(-0.4) * 0.8)


@given(MASKS)
def test_equal_images_match_fully(mask: Mask) -> None:
    assert matching_score(mask, mask) == 1.0


def test_two_empty_images_are_equal_and_one_empty_image_matches_nothing_or_little() -> None:
    empty, full = np.zeros((3, 3), np.uint8), np.ones((3, 3), np.uint8)
    assert matching_score(empty, empty) == 1.0
    assert matching_score(full, empty) == 0.0
    assert matching_score(empty, full) == pytest.approx(exp(-1))


def test_different_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match=r"silhouette has shape \(3, 4\), model image \(4, 3\)"):
        matching_score(np.zeros((3, 4), np.uint8), np.zeros((4, 3), np.uint8))


@given(MASKS, MASKS, MASKS)
def test_more_errors_match_less(silhouette: Mask, model: Mask, worse: Mask) -> None:
    """Pixels of the union that agreed and now differ leave the union as it is."""
    agreed = (silhouette & model & worse).astype(bool)
    missing = model.copy()
    missing[agreed] = 0
    assert (matching_score(silhouette, missing) < matching_score(silhouette, model)) == bool(agreed.any())


@given(MASKS, MASKS)
def test_it_is_a_score_and_what_lies_outside_the_masks_does_not_count(silhouette: Mask, model: Mask) -> None:
    score = matching_score(silhouette, model)
    assert 0.0 <= score <= 1.0
    assert matching_score(np.pad(silhouette, 5), np.pad(model, 5)) == score
    assert matching_score(silhouette * 255, model.astype(bool)) == score


def test_a_pixel_missing_in_the_model_costs_more_than_one_too_many() -> None:
    one, two = np.zeros((2, 5), np.uint8), np.zeros((2, 5), np.uint8)
    one[0], two[:, 0], two[0] = 1, 1, 1
    assert matching_score(two, one) < matching_score(one, two)


@given(MASKS, MASKS)
@settings(deadline=None)  # the first example compiles
def test_the_score_from_counts_is_the_score_of_the_images(silhouette: Mask, model: Mask) -> None:
    counts = (np.count_nonzero(silhouette), np.count_nonzero(model), np.count_nonzero(silhouette & model))
    assert score_of(*counts) == pytest.approx(matching_score(silhouette, model))
