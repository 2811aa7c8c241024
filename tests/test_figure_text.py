"""A body in text: its right is on the left of the first view, its front on the right of the second."""

import numpy as np
import pytest

from common.body.anatomy import TEN_PARTS, Floats
from common.body.definition import neutral_pose
from common.body.kinematics import joint_centres
from common.body.rotation_vectors import rotation_of
from common.formats.trc import Trajectories
from services.takes.figure_text import BRAILLE, COLUMNS, ROWS, captions, facing, figure, pictures
from services.tracker.stature import average_body

MARKERS = [marker.name for marker in TEN_PARTS.markers]


def centres(yaw: float = 0.0) -> dict[str, Floats]:
    pose = neutral_pose(TEN_PARTS, np.array([0.2, 0.95, -0.3]), yaw)
    points = joint_centres(TEN_PARTS, average_body(TEN_PARTS, 1.75), pose)
    return dict(zip(MARKERS, points, strict=True))


def drawn(lines: list[str], view: int) -> np.ndarray:
    """(rows, columns) which characters have a dot."""
    first = view * (COLUMNS + 3)
    return np.array([[char != chr(BRAILLE) for char in line[first : first + COLUMNS]] for line in lines])


def test_all_lines_are_as_long_as_the_captions() -> None:
    points = centres()
    lines = figure(points, facing(points), np.zeros(3))
    assert len(lines) == ROWS
    assert {len(line) for line in lines} == {len(captions())}


@pytest.mark.parametrize("yaw", [0.0, 0.8, -2.0, np.pi])
def test_whichever_way_it_faces_it_is_seen_from_its_own_front(yaw: float) -> None:
    one, other = centres(), centres(yaw)
    hip = other["Hip"] * [1, 0, 1]
    assert figure(one, facing(one), one["Hip"] * [1, 0, 1]) == figure(other, facing(other), hip)


def test_a_right_arm_sideways_is_on_the_left_and_an_arm_to_the_front_on_the_right_of_the_second() -> None:
    points = centres()
    origin = points["Hip"] * [1, 0, 1]
    shoulder, x, z = points["RShoulder"], np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    aside = points | {"RElbow": shoulder - 0.3 * x, "RWrist": shoulder - 0.6 * x}
    front = points | {"RElbow": shoulder + 0.3 * z, "RWrist": shoulder + 0.6 * z}
    turn, half = facing(points), COLUMNS // 2
    view = drawn(figure(aside, turn, origin), 0)
    assert view[:, : half - 4].any()
    assert not view[:, half + 4 :].any()
    view = drawn(figure(front, turn, origin), 1)
    assert view[:, half + 4 :].any()
    assert not view[:, : half - 4].any()


def test_what_is_not_known_is_not_drawn() -> None:
    points = centres()
    lines = figure(points | {name: np.full(3, np.nan) for name in points}, np.eye(3), np.zeros(3))
    assert not drawn(lines, 0).any()
    assert figure({}, np.eye(3), np.zeros(3)) == lines


def test_pictures_come_at_their_rate_stand_on_the_floor_and_tell_the_time() -> None:
    count, rate = 60, 30.0
    row = np.array([centres()[name] for name in MARKERS]) + np.array([0.0, 3.0, 0.0])  # on some other floor
    data = Trajectories(tuple(MARKERS), np.arange(count), np.arange(count) / rate, np.tile(row, (count, 1, 1)), rate)
    texts = pictures(data, 0.5, 1.5, 10.0)
    assert len(texts) == 11
    assert texts[0].endswith("  0.00 s of 1.00 s")
    assert texts[-1].endswith("  1.00 s of 1.00 s")
    lines = texts[0].split("\n")[1:-1]
    assert drawn(lines, 0)[-1].any()
    assert drawn(lines, 0)[1:3].any()
    assert pictures(data, 5.0, 6.0, 10.0) == []


def test_facing_of_nobody_is_none_in_particular() -> None:
    np.testing.assert_array_equal(facing({name: np.zeros(3) for name in MARKERS}), np.eye(3))


def test_facing_takes_the_left_side_to_plus_x() -> None:
    turned = np.empty((3, 3))
    rotation_of(np.array([0.0, 1.1, 0.0]), turned)
    points = centres(1.1)
    np.testing.assert_allclose(facing(points) @ turned, np.eye(3), atol=1e-9)
