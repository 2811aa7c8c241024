"""Decision with the expected body: holes filled, furniture dropped, moving limbs kept."""

import numpy as np

from zenocap.common.arrays import Floats32, Mask
from zenocap.common.vision.foreground import BACKGROUND, STRONG
from zenocap.common.vision.prediction import Prediction, depths
from zenocap.common.vision.prior import explained_share, with_prior
from zenocap.common.vision.silhouette import Extents, SilhouetteOptions, describe

SHAPE = (120, 160)
NOW_S = np.float32(100.0)
MOVING, STILL = np.full(SHAPE, 99.9, np.float32), np.full(SHAPE, 0.0, np.float32)


def painted(*boxes: tuple[int, int, int, int]) -> Mask:
    """Mask of boxes: left, top, right, bottom."""
    mask = np.zeros(SHAPE, np.uint8)
    for left, top, right, bottom in boxes:
        mask[top:bottom, left:right] = 1
    return mask


BODY = painted((60, 20, 90, 100))
EXPECTED = Prediction(0, 0, depths(BODY), 6.0, Extents(60, 89, 20, 99))


def found(mask: Mask, since: Floats32 = MOVING) -> Mask:
    labels = np.where(mask != 0, STRONG, BACKGROUND).astype(np.uint8)
    return with_prior(describe(mask), labels, EXPECTED, since, NOW_S, SilhouetteOptions()).mask


def test_what_is_as_expected_stays() -> None:
    assert np.array_equal(found(BODY), BODY)
    assert np.array_equal(found(BODY, STILL), BODY)


def test_a_hole_deep_in_the_body_is_filled() -> None:
    holed = BODY - painted((72, 50, 78, 56))
    assert np.array_equal(found(holed), BODY)


def test_furniture_that_touches_the_person_is_dropped_and_a_limb_that_moves_is_kept() -> None:
    beside = painted((60, 20, 90, 100), (90, 50, 125, 60))
    assert found(beside, STILL)[:, 100:].sum() == 0
    assert found(beside, MOVING)[52:58, 90:124].all()


def test_a_large_moving_region_beside_the_body_is_another_person() -> None:
    two = painted((60, 20, 90, 100), (90, 20, 120, 100))
    assert found(two, MOVING)[:, 100:].sum() == 0


def test_the_image_decides_within_the_band() -> None:
    wider = painted((57, 17, 93, 103))
    assert np.count_nonzero(found(wider) != wider) < 8  # at most the corners
    narrower = painted((62, 22, 88, 98))
    assert np.count_nonzero(found(narrower) != narrower) < 8


def test_the_share_of_the_body_that_differs() -> None:
    labels = np.where(painted((60, 20, 75, 100)) != 0, STRONG, BACKGROUND).astype(np.uint8)
    assert explained_share(labels, EXPECTED.depth) == 0.5
