"""Fisheye lenses: OpenCV as the oracle, the rectified pinhole, and calibration files."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.common.camera.test_calibration_files import GOOD, refused
from zenocap.common.camera.calibration_files import read_calibration, write_calibration
from zenocap.common.camera.fisheye import MAX_ANGLE, FisheyeLens
from zenocap.services.viewer.sources.resize import Fit, rectification

SIZE = (640, 480)
COEFFICIENTS = (-0.02, 0.004, -0.003, 0.0005)

FILE = (
    GOOD.replace('"left"', '"wide"')
    .replace("[[600.0, 0.0, 319.5], [0.0, 600.0, 239.5]", "[[200.0, 0.0, 325.0], [0.0, 201.0, 236.0]")
    .replace("distortions = [0.0, 0.0, 0.0, 0.0]", "distortions = [-0.02, 0.004, -0.003, 0.0005]")
    .replace("fisheye = false", "fisheye = true")
)


def lens(focal: float = 200.0, coefficients: tuple[float, ...] = COEFFICIENTS) -> FisheyeLens:
    return FisheyeLens(SIZE, np.array([[focal, 0, 325.0], [0, focal + 1, 236.0], [0, 0, 1.0]]), np.array(coefficients))


@given(st.floats(-0.05, 0.05), st.floats(-0.01, 0.01), st.integers(0, 2**31))
def test_rays_are_projected_as_opencv_does(k1, k2, seed):
    one = lens(coefficients=(k1, k2, 0.0, 0.0))
    rays = np.random.default_rng(seed).normal(size=(30, 3))
    rays[:, 2] = abs(rays[:, 2]) + 0.05
    expected = cv2.fisheye.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), one.matrix, one.coefficients)[0][:, 0]
    np.testing.assert_allclose(one.project(rays), expected, atol=1e-6)


@pytest.mark.parametrize("focal", [120.0, 200.0, 300.0, 800.0])
def test_the_rectified_image_shows_what_the_lens_shows_on_its_sides_and_nothing_that_it_does_not(focal):
    one = lens(focal)
    matrix = one.pinhole_matrix()
    border = np.array([(x, y, 1.0) for x in (-0.5, 320.0, 639.5) for y in (-0.5, 240.0, 479.5)])
    seen = one.project(border @ np.linalg.inv(matrix).T)
    assert seen.min() > -0.51
    assert seen[:, 0].max() < SIZE[0] - 0.49
    assert seen[:, 1].max() < SIZE[1] - 0.49
    sides = np.array([325.5, 314.5, 236.5, 243.5]) / matrix[0, 0]
    assert np.arctan(sides).max() <= MAX_ANGLE + 1e-9
    reached = np.isclose(np.arctan(sides), MAX_ANGLE).any() or np.isclose(seen[:, 0].max(), 639.5, atol=0.05)
    assert reached or np.isclose(seen.min(), -0.5, atol=0.05), "smaller than need be"


@pytest.mark.nightly
@pytest.mark.parametrize("working", [SIZE, (320, 240)])
def test_a_point_is_seen_in_the_rectified_image_where_the_camera_projects_it(tmp_path, working):
    (tmp_path / "wide.toml").write_text(FILE)
    camera = read_calibration(tmp_path / "wide.toml")["wide"]
    points = np.array([(x, y, 0.0) for x in (-2.5, -1.0, 0.5, 2.0) for y in (0.3, 1.1, 2.0)])
    for point in points:
        raw = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
        spot = camera.fisheye.project((point @ camera.rotation.T + camera.translation)[None])[0]
        cv2.circle(raw, np.round(16 * spot).astype(int).tolist(), 16 * 6, (255, 255, 255), -1, cv2.LINE_AA, 4)
        small = camera.resized(working)
        seen = Fit(camera.size, small.size, rectification(small))(raw)[..., 0].astype(float)
        rows, columns = np.mgrid[: working[1], : working[0]]
        found = np.array([(seen * columns).sum(), (seen * rows).sum()]) / seen.sum()
        np.testing.assert_allclose(found, small.project(point[None])[0], atol=0.4)


def test_a_fisheye_calibration_is_written_as_it_was_read(tmp_path):
    (tmp_path / "wide.toml").write_text(FILE)
    cameras = read_calibration(tmp_path / "wide.toml")
    write_calibration(tmp_path / "again.toml", {name: one.resized((320, 240)) for name, one in cameras.items()})
    texts = FILE, (tmp_path / "again.toml").read_text()
    read, written = ([line for line in text.splitlines() if "rotation" not in line] for text in texts)
    assert written == [line for line in read if line != "error = 0.0"]  # unknown of a calibration that is read


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("0.0005]", "0.0005, 0.0]", "cam_01.distortions = .*allowed: 4 finite numbers"),
        ("-0.02, ", "-0.9, ", "cam_01.distortions = .*allowed: a lens that shows no direction twice within 60 degrees"),
        ("fisheye = true", "fisheye = 1", "cam_01.fisheye = 1: allowed: true or false"),
    ],
)
def test_wrong_fisheye_calibrations_are_refused(tmp_path, old, new, text):
    refused(tmp_path / "wide.toml", FILE.replace(old, new), text)
