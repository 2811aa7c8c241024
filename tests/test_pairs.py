import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera.pairs import angle_between_deg, attitude, most_orthogonal_pair
from common.camera.pinhole import Camera

FRONT = np.diag([1.0, -1.0, -1.0])  # world to a level camera looking to -Z


def looking(heading_deg: float, tilt_deg: float = 0.0, roll_deg: float = 0.0) -> Camera:
    """A camera that was turned to its heading (from -Z towards +X), then up, then about its own axis."""
    turn = cv2.Rodrigues(np.array([0.0, np.radians(heading_deg), 0.0]))[0]
    tilt = cv2.Rodrigues(np.array([-np.radians(tilt_deg), 0.0, 0.0]))[0]
    roll = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(roll_deg)]))[0]
    rotation = np.asarray(roll @ tilt @ FRONT @ turn)
    return Camera("c", (640, 480), np.diag([600.0, 600.0, 1.0]), np.zeros(4), rotation, np.zeros(3))


@given(st.floats(-175, 175), st.floats(-60, 60), st.floats(-60, 60))
def test_attitude_is_what_the_camera_was_turned_by(heading, tilt, roll):
    found = attitude(looking(heading, tilt, roll))
    assert found.heading_deg == pytest.approx(heading, abs=1e-6)
    assert found.tilt_deg == pytest.approx(tilt, abs=1e-6)
    assert abs(found.roll_deg) == pytest.approx(abs(roll), abs=1e-6)
    assert found.roll_deg * roll >= -1e-6


def test_angle_between_headings_goes_the_short_way():
    assert angle_between_deg(looking(-170), looking(170)) == pytest.approx(20)


def test_the_papers_pair_is_found_with_the_front_view_first():
    found = {"side": looking(90), "oblique": looking(40), "front": looking(0)}
    assert most_orthogonal_pair(found) == ("front", "side")


def test_equally_orthogonal_pairs_are_decided_by_the_front_view():
    ring = {f"cam{k}": looking(k * 360 / 7 - 150) for k in range(7)}
    first, _ = most_orthogonal_pair(ring)
    assert first == min(ring, key=lambda name: abs(attitude(ring[name]).heading_deg))


@given(st.lists(st.floats(-180, 180), min_size=2, max_size=6))
def test_no_pair_is_more_orthogonal_by_more_than_the_tie(headings):
    cameras = {str(k): looking(heading) for k, heading in enumerate(headings)}
    first, second = most_orthogonal_pair(cameras)
    chosen = abs(90 - angle_between_deg(cameras[first], cameras[second]))
    every = [abs(90 - angle_between_deg(cameras[a], cameras[b])) for a in cameras for b in cameras if a != b]
    assert chosen <= min(every) + 2.0


def test_one_camera_is_no_pair():
    with pytest.raises(ValueError, match="two cameras are needed for a pair; there are: a"):
        most_orthogonal_pair({"a": looking(0)})
