"""The model that is drawn for loading is found where it was drawn."""

import pytest

from common.runtime.specs import FirstFrames
from services.viewer.ready import load_compiled
from services.viewer.states import viewer_setup
from tests.actor_cameras import paper_cameras


@pytest.mark.parametrize("size", [(160, 120), (640, 480)])
def test_the_drawn_person_is_found(size: tuple[int, int]) -> None:
    for camera in paper_cameras(size):
        assert load_compiled(viewer_setup("1", camera, FirstFrames(1), False)) > 0.9
