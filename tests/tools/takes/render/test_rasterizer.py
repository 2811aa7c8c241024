"""The compiled rasterizer against plain numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from zenocap.tools.takes.render.rasterizer import fill

SIZE = 24
CORNERS = arrays(np.float32, (9, 2), elements=st.floats(-10, SIZE + 10, width=32))
NEAR = arrays(np.float32, (9,), elements=st.floats(0.125, 4, width=32))


def barycentric(corners: np.ndarray, x: int, y: int) -> np.ndarray:
    """Coordinates of a sample, NaN in a triangle without area."""
    matrix = np.vstack([corners.T.astype(float), np.ones(3)])
    return np.full(3, np.nan) if abs(np.linalg.det(matrix)) < 1e-6 else np.linalg.solve(matrix, [x, y, 1.0])


@pytest.mark.nightly
@given(CORNERS, NEAR)
@settings(deadline=None, max_examples=40)
def test_every_sample_shows_the_nearest_triangle(corners: np.ndarray, near: np.ndarray) -> None:
    triangles = np.arange(9, dtype=np.int32).reshape(3, 3)
    shades = np.repeat(np.arange(3, dtype=np.uint8), 3)
    normals = np.eye(3, dtype=np.float32)[shades]
    out, row = np.zeros((SIZE, SIZE, 4), dtype=np.float32), np.full((SIZE, SIZE), 9, dtype=np.uint8)
    fill(corners, near, normals, shades, triangles, out, row)
    for y in range(0, SIZE, 3):
        for x in range(0, SIZE, 3):
            shares = np.array([barycentric(corners[t], x, y) for t in triangles])
            least = shares.min(axis=1)
            if not (np.abs(least) > 1e-3).all():
                continue  # at an edge, where rounding decides, or of a triangle without area
            depths = sorted((float(shares[k] @ near[triangles[k]]), k) for k in np.flatnonzero(least > 0))
            best, shade = max(depths, default=(0.0, 9))
            if len(depths) > 1 and depths[-1][0] - depths[-2][0] < 1e-4:
                continue
            np.testing.assert_allclose(out[y, x, 0], best, rtol=1e-3, atol=1e-5)
            assert row[y, x] == shade


def test_triangles_behind_the_camera_are_left_out() -> None:
    corners = np.array([[0, 0], [20, 0], [0, 20]], dtype=np.float32)
    out, row = np.zeros((SIZE, SIZE, 4), dtype=np.float32), np.zeros((SIZE, SIZE), dtype=np.uint8)
    normals, shades = np.ones((3, 3), dtype=np.float32), np.ones(3, dtype=np.uint8)
    fill(
        corners, np.array([1.0, 0.0, 1.0], dtype=np.float32), normals, shades, np.array([[0, 1, 2]], dtype=np.int32), out,
        row,
    )  # fmt: skip
    assert not out.any()
