"""Body drawn as text: right and left, front and back."""

import numpy as np
import pytest

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import average_body
from zenocap.tools.takes.figure_text import BRAILLE, COLUMNS, ROWS, captions, facing, figure, pictures

MARKERS = [marker.name for marker in TEN_PARTS.markers]


def centres(yaw: float = 0.0) -> dict[str, Floats]:
    pose = neutral_pose(TEN_PARTS, np.array([0.2, 0.95, -0.3]), yaw)
    points = joint_centres(TEN_PARTS, average_body(TEN_PARTS, 1.75), pose)
    return dict(zip(MARKERS, points, strict=True))


def dots(lines: list[str], view: int) -> np.ndarray:
    """(rows, columns) whether each character has a dot."""
    first = view * (COLUMNS + 3)
    return np.array([[char != chr(BRAILLE) for char in line[first : first + COLUMNS]] for line in lines])


@pytest.mark.parametrize("yaw", [0.0, 0.8, -2.0, np.pi])
def test_figure_does_not_depend_on_the_yaw_of_the_body(yaw: float) -> None:
    one, other = centres(), centres(yaw)
    hip = other["Hip"] * [1, 0, 1]
    lines = figure(other, facing(other), hip)
    assert lines == figure(one, facing(one), one["Hip"] * [1, 0, 1])
    assert len(lines) == ROWS
    assert {len(line) for line in lines} == {len(captions())}


def test_right_arm_is_left_in_the_front_view_and_forward_arm_right_in_the_side_view() -> None:
    points = centres()
    origin = points["Hip"] * [1, 0, 1]
    shoulder, x, z = points["RShoulder"], np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    sideways = points | {"RElbow": shoulder - 0.3 * x, "RWrist": shoulder - 0.6 * x}
    front = points | {"RElbow": shoulder + 0.3 * z, "RWrist": shoulder + 0.6 * z}
    turn, half = facing(points), COLUMNS // 2
    for drawn, number, is_left in ((sideways, 0, True), (front, 1, False)):
        view = dots(figure(drawn, turn, origin), number)
        assert (view[:, : half - 4].any(), view[:, half + 4 :].any()) == (is_left, not is_left)


def test_unknown_joints_are_not_drawn() -> None:
    points = centres()
    lines = figure(points | {name: np.full(3, np.nan) for name in points}, np.eye(3), np.zeros(3))
    assert not dots(lines, 0).any()
    assert figure({}, np.eye(3), np.zeros(3)) == lines


def test_pictures_have_the_given_rate_floor_contact_and_time_stamps() -> None:
    count, rate = 60, 30.0
    row = np.array([centres()[name] for name in MARKERS]) + np.array([0.0, 3.0, 0.0])  # at another floor height
    data = Trajectories(tuple(MARKERS), np.arange(count), np.arange(count) / rate, np.tile(row, (count, 1, 1)), rate)
    texts = pictures(data, 0.5, 1.5, 10.0)
    assert len(texts) == 11
    assert texts[0].endswith("  0.00 s of 1.00 s")
    assert texts[-1].endswith("  1.00 s of 1.00 s")
    lines = texts[0].split("\n")[1:-1]
    assert dots(lines, 0)[-1].any()
    assert dots(lines, 0)[1:3].any()
    assert pictures(data, 5.0, 6.0, 10.0) == []


def test_facing_maps_the_left_side_to_plus_x_and_is_the_identity_without_a_body() -> None:
    turned = np.empty((3, 3))
    vector_to_matrix(np.array([0.0, 1.1, 0.0]), turned)
    points = centres(1.1)
    np.testing.assert_allclose(facing(points) @ turned, np.eye(3), atol=1e-9)
    np.testing.assert_array_equal(facing({name: np.zeros(3) for name in MARKERS}), np.eye(3))
