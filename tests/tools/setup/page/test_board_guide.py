"""The guide: what it asks for is what is missing, and it is ready when nothing is."""

import numpy as np
import pytest

from tests.support.board_bursts import add_second, guide_of, simulated
from tests.support.board_pictures import before, plain_camera, true_pixels
from tests.support.board_views import BOARD
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.page.board_guide import REGIONS, SIDES, BoardGuide, CameraProgress, tilted_side
from zenocap.tools.setup.page.parameters import MIN_CAMERA_MOMENTS, MIN_MOMENTS

SIZE = (640, 480)
CAMERA = plain_camera(SIZE)


def view(distance_m=1.6, turn=(0, 0, 0), aside=(0.0, 0.0), time_s=0.0) -> View:
    pixels = true_pixels(BOARD, CAMERA, before(BOARD, distance_m, turn, aside))
    inside = (pixels > 0).all(axis=1) & (pixels < np.array(SIZE) - 1).all(axis=1)
    return View(time_s, np.flatnonzero(inside), pixels[inside], np.zeros((int(inside.sum()), 2)))


def guide(*names: str) -> BoardGuide:
    return BoardGuide(BOARD.corners, [CameraProgress(name, SIZE) for name in names])


def show(one: BoardGuide, count: int, *groups: tuple[int, ...]) -> None:
    """Show the board at `count` places to groups of cameras, one group after the other."""
    for k in range(count):
        place = view(aside=(0.15 * np.cos(k), 0.15 * np.sin(k)))
        for group in groups:
            one.add(dict.fromkeys(group, place))


@pytest.mark.parametrize(
    ("turn", "side"),
    [
        ((0.0, 0.6, 0.0), "right"),
        ((0.0, -0.6, 0.0), "left"),
        ((0.6, 0.0, 0.0), "upper"),
        ((-0.6, 0.0, 0.0), "lower"),
        ((0.0, 0.1, 0.0), None),
    ],
)
def test_the_tilted_side_is_the_edge_that_looks_larger(turn, side):
    one = view(turn=turn)
    assert tilted_side(one, BOARD.corners, SIZE) == side
    grid = one.pixels.reshape(BOARD.rows - 1, BOARD.columns - 1, 2)
    left, right = np.linalg.norm(grid[-1] - grid[0], axis=1)[[0, -1]]
    upper, lower = np.linalg.norm(grid[:, -1] - grid[:, 0], axis=1)[[0, -1]]
    larger = {"left": left > right, "right": right > left, "upper": upper > lower, "lower": lower > upper}
    assert side is None or larger[side]


def test_a_board_at_rest_is_one_moment():
    one = guide("left", "right")
    for k in range(20):
        one.add({0: view(time_s=k), 1: view(time_s=k)})
    assert [camera.moments for camera in one.cameras] == [1, 1]
    assert one.pairs == {(0, 1): 1}


def test_first_it_asks_for_the_board_then_for_the_camera_that_has_not_seen_it():
    one = guide("left", "right")
    assert one.advice()[0].startswith("Hold the board before a camera")
    one.add({0: view()})
    assert one.advice()[:2] == ("Show the board to right: it has not seen it yet.", "right")


def test_while_the_graph_is_in_pieces_it_names_who_is_missing_and_is_not_ready():
    one = guide("left", "right", "door")
    show(one, MIN_MOMENTS, (0, 1), (2,))
    assert one.groups() == [[0, 1], [2]]
    assert one.missing == ["door"]
    assert not one.ready
    sentence, about, _ = one.advice()
    assert "door both see it" in sentence
    assert about == "door"
    show(one, MIN_MOMENTS - 1, (1, 2))
    assert one.advice()[0].startswith("Hold the board so that right and door both see it")
    one.add({1: view(0.9), 2: view(0.9)})
    assert one.missing == []


def test_cameras_are_connected_along_a_chain():
    one = guide("a", "b", "c", "d")
    show(one, MIN_MOMENTS, (0, 1), (2, 3), (1, 2))
    assert one.groups() == [[0, 1, 2, 3]]


@pytest.mark.parametrize(("name", "columns", "rows"), REGIONS, ids=[region[0] for region in REGIONS])
def test_it_asks_for_the_part_of_the_image_that_is_not_covered(name, columns, rows):
    grid = np.ones((4, 6), dtype=bool)
    grid[rows, columns] = False
    assert CameraProgress("left", SIZE, cells=grid.ravel()).region() == name


def test_then_it_asks_for_tilts_of_the_side_that_is_missing():
    one = guide("left")
    show(one, MIN_CAMERA_MOMENTS, (0,))
    one.cameras[0].cells[:] = True
    one.cameras[0].tilted.update(left=9, right=9)
    assert one.cameras[0].enough
    one.cameras[0].tilted.update(right=0, upper=1, lower=1)
    assert one.advice()[0] == "Tilt it more before left: turn its right edge towards the camera."
    one.cameras[0].tilted.update(dict.fromkeys(SIDES, 3))
    assert one.advice()[0].startswith("Enough")
    assert one.ready


def test_known_lenses_need_no_coverage():
    one = BoardGuide(BOARD.corners, [CameraProgress("left", SIZE)], lens_known=True)
    show(one, MIN_MOMENTS, (0,))
    assert one.ready


@pytest.mark.nightly
def test_of_a_board_that_is_carried_about_the_guide_becomes_ready():
    seen = simulated(2, 45.0)
    one = guide_of(seen)
    said = []
    for second in range(45):
        add_second(one, seen, second)
        said.append(one.advice()[0])
        if one.ready:
            break
    assert one.ready
    assert said[-1].startswith("Enough")
    assert len(set(said)) > 3
