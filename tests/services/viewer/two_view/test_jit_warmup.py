"""Warm-up: tracking recovers the pose of the model drawn for it."""

import pytest

from tests.support.simulated_cameras import paper_cameras
from zenocap.common.rig.sources import FirstFrames
from zenocap.services.viewer.two_view.jit_warmup import load_compiled
from zenocap.services.viewer.two_view.states import TwoViewSetup


@pytest.mark.parametrize("size", [(160, 120), (640, 480)])
def test_warm_up_recovers_the_drawn_pose(size: tuple[int, int]) -> None:
    for camera in paper_cameras(size):
        assert load_compiled(TwoViewSetup("1", camera, FirstFrames(1))) > 0.9
