"""First lenses from views with known truth: model, values, held-out error."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_pictures import before, plain_camera
from tests.support.board_views import with_fisheye
from tests.support.carried_board import seen_corners
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_views import CameraViews, View
from zenocap.tools.setup.calibration.lens_choice import first_lens, held_out_error, spread_views
from zenocap.tools.setup.calibration.lens_model import LensModel

BOARD = checked_board("charuco", 5, 7, 35.0)
SIZE = (1280, 720)
NORMAL, WIDE = plain_camera(SIZE, 900.0), plain_camera(SIZE, 600.0, -0.2)
STRAIGHT = replace(NORMAL, distortions=np.zeros(5))
FISHEYE = with_fisheye(plain_camera(SIZE))
NOISE_PX = 0.1


def shown(
    camera: Camera, seed: int, near: float, far: float, aside: float, count: int = 40, noise_px: float = NOISE_PX
) -> CameraViews:
    """Views of the board at rest, from `near` to `far` m, up to `aside` of the distance off the axis."""
    rng, views = np.random.default_rng(seed), []
    while len(views) < count:
        distance = rng.uniform(near, far)
        pose = before(BOARD, distance, rng.normal(0, [0.4, 0.4, 0.8]), rng.normal(0, aside, 2) * distance)
        local = BOARD.corners @ pose[0].T + pose[1]
        pixels, seen = seen_corners(camera, BOARD.corners, pose)
        seen &= local[:, 2] > 0.02
        if camera.fisheye is None:
            seen &= np.hypot(*local[:, :2].T) < local[:, 2]  # beyond, the polynomial of the lens turns back
        if seen.sum() >= 6 and np.linalg.matrix_rank(pixels[seen] - pixels[seen].mean(axis=0), 20.0) == 2:
            pixels = pixels[seen] + noise_px * rng.standard_normal((seen.sum(), 2))
            views.append(View(float(len(views)), np.flatnonzero(seen), pixels, np.zeros_like(pixels)))
    return CameraViews(camera.name, camera.size, 1.0, count, tuple(views), True)


def worst_px(lens: LensModel, camera: Camera, seen: CameraViews) -> float:
    """Largest distance of the images of rays by the two lenses, where corners were seen."""
    pixels = np.concatenate([view.pixels for view in seen.views])
    rays = LensModel.of(Lens.of(camera)).rays(pixels)
    found = lens.project(np.column_stack([rays, np.ones(len(rays))]))[0]
    return float(np.quantile(np.hypot(*(found - pixels).T), 0.9))


NEAR, FAR = (0.08, 0.3, 0.8), (0.3, 0.8, 0.2)  # from, to, and how far off the axis; near, the board fills the image


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("camera", "places", "fisheye", "off_px"),
    [(FISHEYE, NEAR, True, 1.5), (NORMAL, FAR, False, 4.0), (WIDE, FAR, False, 4.0), (STRAIGHT, FAR, False, 4.0)],
    ids=["fisheye", "normal", "wide", "straight"],
)
@pytest.mark.parametrize("seed", range(4))
def test_the_true_lens_is_chosen(camera, places, fisheye, off_px, seed):
    seen = shown(camera, seed, *places)
    lens, error = first_lens(seen, BOARD.corners)
    assert lens.fisheye == fisheye
    true = (camera.fisheye or camera).matrix
    assert lens.values[:4] == pytest.approx([true[0, 0], true[1, 1], true[0, 2], true[1, 2]], abs=off_px)
    assert worst_px(lens, camera, seen) < 6.0
    assert error == pytest.approx(np.sqrt(2) * NOISE_PX, rel=0.25)


@pytest.mark.nightly
def test_a_view_from_which_opencv_starts_wrongly_does_not_prevent_a_fisheye_lens():
    """With seven corners at the edge, cv2.fisheye.calibrate ends in an assertion or in a wrong pose."""
    seen = shown(FISHEYE, 1, 0.12, 0.35, 1.2)
    lens, _ = first_lens(seen, BOARD.corners)
    assert lens.title == "fisheye lens"
    assert worst_px(lens, FISHEYE, seen) < 2.0


@pytest.mark.nightly
def test_a_fisheye_camera_whose_board_is_far_away_does_not_need_one():
    """There the models agree: rectification would cost time for nothing."""
    lens, error = first_lens(shown(FISHEYE, 0, 0.8, 2.0, 0.3), BOARD.corners)
    assert not lens.fisheye
    assert error == pytest.approx(np.sqrt(2) * NOISE_PX, rel=0.25)


def test_few_views_give_the_smallest_model_and_fewer_than_four_none():
    seen = shown(NORMAL, 1, 0.3, 0.8, 0.2, count=6)
    lens, _ = first_lens(seen, BOARD.corners)
    assert lens.title == "4 coefficients"
    assert lens.values[0] == pytest.approx(900.0, rel=0.02)
    with pytest.raises(UserError, match="cam01: the board is found in 3 images, 3 of them of different places: allowed: 4"):
        first_lens(replace(seen, views=seen.views[:3]), BOARD.corners)


@pytest.mark.nightly
def test_views_from_which_no_lens_follows_are_an_error():
    """Corners at random places of the image."""
    rng = np.random.default_rng(0)
    views = tuple(View(float(k), np.arange(24), rng.uniform(0, 700, (24, 2)), np.zeros((24, 2))) for k in range(20))
    with pytest.raises(UserError, match="cam01: no lens fits the views of the board: show it nearer"):
        first_lens(CameraViews("cam01", SIZE, 1.0, 20, views, True), BOARD.corners)


def test_held_out_error_is_that_of_the_noise_and_grows_with_a_wrong_lens():
    views, true = shown(NORMAL, 2, 0.3, 0.8, 0.2, noise_px=0.3).views, LensModel.of(Lens.of(NORMAL))
    error = held_out_error(true, views, BOARD.corners)
    assert error == pytest.approx(0.3 * np.sqrt(2), rel=0.2)  # the pose takes up a little of it
    wrong = replace(true, values=true.values * np.array([1.3, 1.3, 1, 1, 1, 1, 1, 1, 1]))
    assert held_out_error(wrong, views, BOARD.corners) > 1.5 * error
    on_a_line = View(99.0, np.arange(4), 100.0 + 50.0 * np.arange(8.0).reshape(4, 2), np.zeros((4, 2)))  # no pose
    assert held_out_error(true, [on_a_line], BOARD.corners) == np.inf
    assert held_out_error(true, [*views, on_a_line], BOARD.corners) < 1.5 * error  # it does not decide


def test_spread_views_cover_the_image_and_are_slow():
    place = np.array([[100.0, 100.0], [110.0, 100.0], [100.0, 110.0]])

    def view(number, offset, speed):
        return View(float(number), np.arange(3), place + offset, np.full((3, 2), speed))

    many = [view(k, 5.0 * (k % 2), 500.0) for k in range(20)]  # of a board that rests, one view is used
    slow, elsewhere = view(20, 0.0, 1.0), view(21, np.array([900.0, 400.0]), 500.0)
    seen = CameraViews("a", SIZE, 0.1, 22, (*many, slow, elsewhere))
    assert {view.time_s for view in spread_views(seen, 2)} == {20.0, 21.0}
    assert len(spread_views(seen, 100)) == 22
    unknown = replace(seen, views=tuple(replace(view, velocities=np.full((3, 2), np.nan)) for view in seen.views))
    assert len({view.time_s for view in spread_views(unknown, 5)}) == 5
