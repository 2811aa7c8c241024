"""Lens distortion of compiled loops against OpenCV, forward and inverse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.hull.views import distort, lens_parameters, undistort

TERMS = {
    "none": np.zeros(4),
    "four": np.array([-0.2, 0.05, 0.001, -0.002]),
    "five": np.array([-0.28, 0.09, 0.0005, 0.001, -0.01]),
    "rational": np.array([0.3, 0.1, 0.001, -0.001, 0.02, 0.5, 0.1, 0.03]),
    "prism": np.array([-0.1, 0.02, 0.001, -0.001, 0.0, 0.0, 0.0, 0.0, 0.002, -0.001, 0.003, 0.001]),
}


def camera(terms: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Camera:
    matrix = np.array([[620.0, 0.0, 310.0], [0.0, 600.0, 250.0], [0.0, 0.0, 1.0]])
    return Camera("bent", (640, 480), matrix, terms, np.eye(3), np.zeros(3))


@pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS.keys())
def test_distortion_equals_opencv(terms: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    there = camera(terms)
    lens = lens_parameters(there)
    places = np.array([[x, y, 1.0] for x in np.linspace(-0.45, 0.45, 7) for y in np.linspace(-0.35, 0.35, 5)])
    for (x, y, _), (u, v) in zip(places, there.project(places), strict=True):
        bent_x, bent_y = distort(lens[None], 0, x, y)
        assert lens[0] * bent_x + lens[1] * bent_y + lens[2] == pytest.approx(u, abs=1e-9)
        assert lens[3] * bent_y + lens[4] == pytest.approx(v, abs=1e-9)


@given(st.sampled_from(sorted(TERMS)), st.floats(0, 639), st.floats(0, 479))
def test_undistortion_inverts_distortion(name: str, u: float, v: float) -> None:
    there = camera(TERMS[name])
    x, y = undistort(lens_parameters(there)[None], 0, u, v)
    assert there.project(np.array([[x, y, 1.0]]))[0] == pytest.approx([u, v], abs=0.01)


def test_tilted_sensor_is_refused() -> None:
    with pytest.raises(ValueError, match=r"camera bent: distortions\[12:\] = .*allowed: 0"):
        lens_parameters(camera(np.array([*np.zeros(12), 0.1, 0.0])))
    assert len(lens_parameters(camera(np.zeros(14)))) > 0
