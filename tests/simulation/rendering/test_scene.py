"""The room: equal for all image sizes of a camera, different for each seed."""

import cv2
import numpy as np
import pytest

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.simulation.rendering.scene import room, view


@pytest.mark.slow
def test_equal_seeds_give_equal_rooms() -> None:
    camera = paper_cameras((160, 120))[0]
    first, again, other = (view(room(camera, seed), camera).bgr for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.abs(first - other).mean() > 5.0


@pytest.mark.nightly
def test_a_small_image_is_the_large_one_scaled() -> None:
    large, small = paper_cameras()[0], paper_cameras((160, 120))[0]
    big = cv2.resize(view(room(large, 1), large).bgr, (160, 120), interpolation=cv2.INTER_AREA)
    assert np.abs(big - view(room(small, 1), small).bgr).mean() < 3.0


@pytest.mark.nightly
def test_the_floor_ends_where_the_ground_meets_the_wall() -> None:
    camera = paper_cameras()[0]
    place = room(camera, 1)
    floor = view(place, camera).floor
    row = float(camera.project(np.array([[0.0, 0.0, -place.half]]))[0, 1])
    assert np.all(floor[: int(row) - 1] == 0.0)
    assert np.all(floor[int(row) + 2 :] == 1.0)


@pytest.mark.parametrize("height", [0.3, 2.5, 6.0])
def test_room_is_rendered_for_any_camera_position(height: float) -> None:
    camera = look("far", np.array([9.0, height, 9.0]), np.array([0.0, 1.0, 0.0]), roll=0.3).resized((80, 60))
    image = view(room(camera, 5), camera)
    assert np.isfinite(image.bgr).all()
    assert 0.0 <= image.bgr.min() <= image.bgr.max() <= 255.0
    assert image.floor.max() == 1.0
