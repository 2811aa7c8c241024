"""Real clips whose light is changed: the film, and silhouettes with and without a change."""

import cv2
import numpy as np
import pytest

from benchmarks.cases.rooms.film import CHANGE_S, EMPTY_S, FPS
from benchmarks.cases.rooms.real_light import film, masks
from benchmarks.cases.rooms.silhouettes import NAMED, overlap
from tests.support.simulated_cameras import look

SIZE = (96, 72)
LAMP = NAMED["lamp switched off"].tone


def room_and_figures() -> tuple[np.ndarray, list[np.ndarray]]:
    plate = np.full((SIZE[1], SIZE[0], 3), 120, np.uint8)
    images = []
    for x in range(30, 60, 2):
        image = plate.copy()
        cv2.rectangle(image, (x, 15), (x + 12, 65), (30, 60, 200), -1)
        images.append(image)
    return plate, images


def test_the_film_is_the_empty_room_and_then_the_video_to_and_fro() -> None:
    plate, images = room_and_figures()
    shots = list(film(plate, images))
    first = int(EMPTY_S * FPS)
    assert all(np.abs(image.astype(int) - plate).max() < 15 for _, image in shots[:first])
    turn = first + len(images) - 1
    assert np.array_equal(shots[first][1], images[0])
    assert np.array_equal(shots[turn][1], images[-1])
    assert np.array_equal(shots[turn + 1][1], images[-2])


@pytest.mark.nightly
def test_a_lamp_that_is_switched_off_ruins_a_fixed_background_and_not_one_that_adapts() -> None:
    camera = look("cam01", np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0]), 0.0).resized(SIZE)
    shots = list(film(*room_and_figures()))
    after = int((CHANGE_S - EMPTY_S + 1.0) * FPS)
    mean = {}
    for method in ("first:60", "adaptive"):
        plain, changed = (masks(camera, method, shots, tone) for tone in (None, LAMP))
        mean[method] = float(np.mean([overlap(a, b) for a, b in zip(changed[after:], plain[after:], strict=True)]))
    assert mean["adaptive"] > 0.8
    assert mean["first:60"] < 0.6
