"""The search of the board in stretches of images of several cameras."""

import cv2
import numpy as np
import pytest

from tests.support.board_pictures import before, picture_of, plain_camera, true_pixels
from zenocap.services.viewer.frame import Frame
from zenocap.tools.setup.calibration.board import Board, checked_board
from zenocap.tools.setup.page.board_search import VariantSearch, searched

BOARD = checked_board("charuco", 5, 7, 60.0)
CAMERA = plain_camera((480, 360), focal=450.0)
PERIOD_NS = 66_000_000


def image(board: Board, aside: float = 0.0) -> np.ndarray:
    return cv2.cvtColor(picture_of(board, CAMERA, before(board, 0.9, aside=(aside, 0.0))), cv2.COLOR_GRAY2BGR)


def frames(images: list[np.ndarray], first_ns: int = 0) -> list[Frame]:
    return [Frame(k, first_ns + k * PERIOD_NS, one) for k, one in enumerate(images)]


EMPTY = np.full((360, 480, 3), 150, dtype=np.uint8)


@pytest.mark.nightly
def test_one_moment_of_all_cameras_and_the_images_around_it():
    moving = [image(BOARD, 0.02 * k) for k in range(5)]
    burst = searched(BOARD, [frames(moving), frames(moving, 20_000_000), frames([EMPTY] * 5)], [0.066] * 3, 0)
    assert set(burst.moment) == {0, 1}
    assert abs(burst.moment[0].time_s - burst.moment[1].time_s) < 0.04
    assert [len(burst.views[k]) for k in (0, 1)] == [5, 5]
    assert burst.looks == {0: 5, 1: 5, 2: 1}
    truth = true_pixels(BOARD, CAMERA, before(BOARD, 0.9, aside=(0.04, 0.0)))
    middle = burst.views[0][2]
    assert np.abs(middle.pixels - truth[middle.ids]).max() < 0.6


def test_a_camera_that_sees_it_alone_is_searched_in_its_next_images_only():
    burst = searched(BOARD, [frames([image(BOARD)] * 5), frames([EMPTY] * 5)], [0.066] * 2, 0)
    assert len(burst.views[0]) == 3
    assert burst.looks == {0: 3, 1: 1}


def test_images_of_another_time_are_no_moment():
    burst = searched(BOARD, [frames([image(BOARD)] * 3), frames([image(BOARD)] * 3, 10**9)], [0.066] * 2, 0)
    assert burst.moment == {}
    assert searched(BOARD, [[], []], [0.066] * 2, 0).views == {}


@pytest.mark.slow
@pytest.mark.parametrize("inverted", [False, True])
def test_the_variant_is_told_by_a_few_images(inverted):
    shown = Board("charuco", 5, 7, 0.06, 0.045, inverted=inverted)
    search = VariantSearch(BOARD)
    empty, grey = (cv2.cvtColor(one, cv2.COLOR_BGR2GRAY) for one in (EMPTY, image(shown)))
    assert [search.add(one) for one in (empty, grey, grey, grey, grey)] == [False, False, False, True, False]
    assert search.board.inverted == inverted
