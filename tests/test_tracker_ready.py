"""Before the first instant the tracker has followed somebody once, so that all that is compiled is there."""

from dataclasses import replace

import numpy as np
import pytest
from tracker_stand_in import tracker_setup

from common.body.anatomy import FOURTEEN_PARTS
from services.tracker.phases import Options
from services.tracker.ready import load_compiled


def test_it_gets_as_far_as_tracking() -> None:
    setup = replace(tracker_setup(4), anatomy=FOURTEEN_PARTS, options=Options(particles=4, points=150))
    assert load_compiled(setup) == "tracking"


@pytest.mark.parametrize("shift", [20.0, -6.0])
def test_cameras_that_do_not_see_the_origin_are_no_error(shift: float) -> None:
    """Far away, or with the person behind them."""
    setup = tracker_setup(3)
    moved = {
        viewer: replace(camera, translation=camera.translation + np.array([0.0, 0.0, shift]))
        for viewer, camera in setup.cameras.items()
    }
    setup = replace(setup, anatomy=FOURTEEN_PARTS, cameras=moved, options=Options(particles=4, points=150))
    words = load_compiled(setup)
    assert "waiting" in words or "seeing" in words or "stretch" in words or "tracking" in words, words
