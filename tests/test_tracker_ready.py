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


@pytest.mark.parametrize(("shift", "words"), [(20.0, "tracking"), (-6.0, "waiting for a person")])
def test_cameras_that_do_not_see_the_origin_well_are_no_error(shift: float, words: str) -> None:
    """Far away, or with the person behind them: then somebody at the origin cannot be followed."""
    setup = tracker_setup(3)
    moved = {
        viewer: replace(camera, translation=camera.translation + np.array([0.0, 0.0, shift]))
        for viewer, camera in setup.cameras.items()
    }
    setup = replace(setup, anatomy=FOURTEEN_PARTS, cameras=moved, options=Options(particles=4, points=150))
    assert load_compiled(setup) == words
