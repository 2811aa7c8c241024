"""One camera alone: tilt, roll, height and the person's way, from upright bodies of known height."""

import numpy as np
import pytest

from tests.support.upright import HEIGHT_M, figure, hulls_seen, level_camera
from zenocap.tools.setup.calibration.walk.single_view import elevations, level_frame, single_view, up_of


@pytest.mark.slow
@pytest.mark.parametrize(("tilt_deg", "roll_deg", "height_m"), [(-12.0, 0.0, 2.4), (-5.0, 4.0, 1.5), (4.0, -3.0, 0.8)])
def test_attitude_height_and_way_are_found(tilt_deg, roll_deg, height_m):
    camera = level_camera(np.radians(tilt_deg), np.radians(roll_deg), height_m)
    path = figure()
    found = single_view(hulls_seen(camera, path), HEIGHT_M)
    assert found is not None
    np.testing.assert_allclose(found.rotation[:, 1], up_of(np.radians(tilt_deg), np.radians(roll_deg)), atol=0.004)
    assert found.height_m == pytest.approx(height_m, abs=0.03)
    true = (path[:, 0] - camera.centre[0]) + 1j * (path[:, 1] - camera.centre[2])
    inner = slice(3, -3)  # of the running median
    assert np.median(np.abs(found.track - true)[inner]) < 0.06


def test_the_level_frame_is_right_handed_and_level():
    frame = level_frame(up_of(-0.3, 0.1))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
    assert abs(frame[0, 2]) < 0.2  # back is back
    assert frame[2, 2] < -0.9


def test_a_person_who_is_cut_has_no_elevations():
    camera = level_camera(-0.1, 0.0, 1.5)
    hulls = hulls_seen(camera, figure())
    hulls.cut[:] = True
    assert np.isnan(elevations(hulls, up_of(-0.1, 0.0)).top).all()
    assert single_view(hulls, HEIGHT_M) is None
