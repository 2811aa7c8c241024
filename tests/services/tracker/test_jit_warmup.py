"""Warm-up: compiled functions are loaded by tracking an average person."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from tests.support.tracker_stand_in import tracker_setup
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.filter import limb_search
from zenocap.services.tracker.jit_warmup import load_compiled
from zenocap.services.tracker.states import Options


@pytest.mark.nightly
def test_warm_up_reaches_tracking_and_the_search_of_a_limb(monkeypatch: pytest.MonkeyPatch) -> None:
    """A live tracker whose first lost limb is compiled for stops for many seconds."""
    searched = Mock(wraps=limb_search.place_limb)
    monkeypatch.setattr(limb_search, "place_limb", searched)
    setup = replace(tracker_setup(4), anatomy=FOURTEEN_PARTS, options=Options(particles=4, points=150))
    assert load_compiled(setup) == "tracking"
    assert searched.called


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shift", "words"), [(20.0, "tracking, front or back is not certain"), (-6.0, "waiting for a person")]
)
def test_warm_up_accepts_cameras_without_view_of_the_origin(shift: float, words: str) -> None:
    """Far away, or with the person behind them."""
    setup = tracker_setup(3)
    moved = {
        viewer: replace(camera, translation=camera.translation + np.array([0.0, 0.0, shift]))
        for viewer, camera in setup.cameras.items()
    }
    setup = replace(setup, anatomy=FOURTEEN_PARTS, cameras=moved, options=Options(particles=4, points=150))
    assert load_compiled(setup) == words
