"""Calibration from line markers: exact without noise; contradictory measurements."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from zenocap.common.camera.line_calibration import Measurements, Pinnacles, calibrate_lines
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError

FACING = (np.diag([1.0, -1.0, -1.0]), np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))


def level_camera(facing: int, focal: float, centre: tuple[float, float, float], size: tuple[int, int]) -> Camera:
    matrix = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1.0]])
    return Camera("c", size, matrix, np.zeros(4), FACING[facing], -FACING[facing] @ np.array(centre))


def measure(one: Camera, two: Camera, d_x: float, d_z: float, t: float, noise: float = 0.0, seed: int = 0) -> Measurements:
    rng = np.random.default_rng(seed)
    points = np.array([[0, t, 0], [0, t, d_z], [d_x, t, 0.0]])
    seen = [camera.project(points) + noise * rng.standard_normal((3, 2)) for camera in (one, two)]
    pinnacles = [Pinnacles(*((float(x), float(y)) for x, y in pixels)) for pixels in seen]
    return Measurements(one.size, d_x, d_z, t, pinnacles[0], pinnacles[1])


def paper(size: tuple[int, int] = (160, 120), focal: float = 150.0, y: float = 1.0) -> tuple[Camera, Camera]:
    return level_camera(0, focal, (0, y, 5.2), size), level_camera(1, focal, (-5.2, y, 0), size)


@pytest.mark.slow
@given(
    focal=st.floats(120, 180),
    # At larger distances the pinnacles differ by less than PIXEL_NOISE.
    distances=st.tuples(st.floats(3.5, 6.5), st.floats(3.5, 6.5)),
    height=st.floats(0.8, 1.3),
    d=st.tuples(st.sampled_from([-0.9, 0.6, 0.9]), st.sampled_from([-0.9, 0.6, 0.9])),
)
def test_noiseless_markers_reproduce_the_cameras(focal, distances, height, d):
    one = level_camera(0, focal, (0, height, distances[0]), (160, 120))
    two = level_camera(1, focal, (-distances[1], height, 0), (160, 120))
    measured = measure(one, two, *d, 0.2)
    pixels = [pixel for seen in (measured.camera1, measured.camera2) for pixel in (seen.a, seen.b, seen.c)]
    assume(all(-0.5 <= column <= 159.5 and -0.5 <= row <= 119.5 for column, row in pixels))
    for solved, true in zip(calibrate_lines(measured), (one, two), strict=True):
        np.testing.assert_allclose(solved.camera.centre, true.centre, atol=1e-6)
        np.testing.assert_allclose(solved.camera.matrix, true.matrix, atol=1e-4)
        np.testing.assert_allclose(solved.camera.rotation, true.rotation)
        assert np.abs(solved.residuals_px).max() < 1e-6


@pytest.mark.slow
def test_pixel_noise_moves_the_distance_by_its_standard_deviation():
    measured = [measure(*paper((640, 480), 600.0), 0.8, 0.8, 0.05, 0.5, seed) for seed in range(300)]
    solved = [calibrate_lines(m)[0] for m in measured]
    spread = np.std([s.distance_m for s in solved])
    assert spread == pytest.approx(np.median([s.distance_error_m for s in solved]), rel=0.25)
    # Noise hardly changes the size at the origin: focal length over distance.
    assert np.std([s.focal_px / s.distance_m for s in solved]) * 5.2 / 600 < 0.01


def test_the_focal_length_is_within_two_percent_under_noise_with_a_measured_distance():
    for seed in range(20):
        measured = measure(*paper((640, 480), 600.0), 1.0, 1.0, 1.7, 0.5, seed)
        measured = replace(measured, camera1=replace(measured.camera1, distance_m=5.2))
        solved = calibrate_lines(measured)[0]
        assert solved.focal_px == pytest.approx(600, rel=0.02)
        assert solved.camera.centre[1] == pytest.approx(1.0, abs=0.03)
        assert solved.remarks == ()


def test_a_distance_dominated_by_noise_gives_a_remark():
    solved = calibrate_lines(measure(*paper(), 0.5, 0.5, 1.6))[0]
    assert any("measure it with a tape" in remark for remark in solved.remarks)


MEASURED = measure(*paper(), 1.0, 1.0, 1.6)


def with_pinnacles(**changes: object) -> Measurements:
    return replace(MEASURED, camera1=replace(MEASURED.camera1, **changes))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"size": (1, 120)}, "size = 1 x 120: allowed"),
        ({"d_x": 0.0}, "d_x = 0.0: allowed: 0.05 to 100 m"),
        ({"d_z": float("nan")}, "d_z = nan: allowed"),
        ({"t": 1700.0}, "t = 1700.0: allowed: 0.05 to 10 m"),
        ({"d_x": -1.0}, "is the image mirrored or are objects swapped"),
    ],
)
def test_impossible_distances_are_refused(change, text):
    with pytest.raises(UserError, match=text):
        calibrate_lines(replace(MEASURED, **change))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"a": (200.0, 10.0)}, r"camera 1: a = \(200.0, 10.0\): allowed: inside the image of 160 x 120 px"),
        ({"distance_m": 5200.0}, "camera 1: distance = 5200.0: allowed: 0.2 to 100 m"),
        ({"height_m": 1000.0}, "camera 1: height = 1000.0: allowed: -10 to 20 m"),
        ({"distance_m": 0.5}, "more than the 1 m of the marker"),
        ({"b": (79.5, 80.0)}, "both on one side"),
        ({"b": (79.5, 50.0)}, "give a distance of"),
    ],
)
def test_impossible_pinnacles_are_refused(change, text):
    with pytest.raises(UserError, match=text):
        calibrate_lines(with_pinnacles(**change))


def test_pinnacles_at_the_cameras_height_raise_an_error():
    with pytest.raises(UserError, match="distance cannot be determined; give the measured distance"):
        calibrate_lines(measure(*paper(y=1.0), 1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"a": (84.0, 42.2)}, "turn the camera until the line marker lies on the two middle columns"),
        ({"c": (108.0, 37.0)}, "level the camera"),
        ({"distance_m": 9.0}, "measured distance 9.00 m, but the apparent sizes give"),
        ({"distance_m": 5.2, "height_m": 1.4}, "measured height 1.40 m, but the pinnacles give 1.00 m"),
    ],
)
def test_contradictory_measurements_give_remarks(change, text):
    solved = calibrate_lines(with_pinnacles(**change))[0]
    assert any(text in remark for remark in solved.remarks), solved.remarks
