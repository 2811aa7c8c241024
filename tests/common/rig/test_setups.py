"""Rigs rejected by viewer and integrator at the start."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.simulated_cameras import look, paper_cameras
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.rig.sources import BackgroundImage, FirstFrames
from zenocap.services.integrator.states import integrator_setup
from zenocap.services.viewer.states import ViewerSetup

ONE, TWO = paper_cameras()
CEILING = look("ceiling", np.array([0.0, 3.0, 0.0]), np.array([0.1, 0.0, 0.0]))


@pytest.mark.parametrize("cameras", [{}, {"1": ONE}, {"1": ONE, "2": TWO, "3": ONE}])
def test_two_view_needs_two_viewers(cameras: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=f"two-view needs two viewers; the rig has {len(cameras)}"):
        integrator_setup(TEN_PARTS, cameras, 66_000_000)  # type: ignore[arg-type]


def test_error_names_a_camera_that_points_straight_down() -> None:
    with pytest.raises(ValueError, match="camera ceiling"):
        integrator_setup(TEN_PARTS, {"1": ONE, "2": CEILING}, 66_000_000)
    assert ViewerSetup("1", CEILING, FirstFrames(10)).camera is CEILING  # its silhouettes are of use for the tracker


def test_a_missing_background_image_is_refused() -> None:
    with pytest.raises(ValueError, match=r"viewer 1: background image .*plate\.png is missing"):
        ViewerSetup("1", ONE, BackgroundImage(Path("plate.png")))


def test_the_integrator_uses_level_cameras() -> None:
    tilted = look("tilted", np.array([0.0, 2.0, 5.0]), np.array([0.0, 0.9, 0.0]))
    setup = integrator_setup(TEN_PARTS, {"1": tilted, "2": TWO}, 66_000_000)
    np.testing.assert_allclose(setup.cameras["1"].rotation[1], [0, -1, 0], atol=1e-9)
    assert list(setup.cameras) == ["1", "2"]
