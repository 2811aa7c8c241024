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

SMALL = Options(particles=4, points=150)


@pytest.mark.nightly
def test_warm_up_reaches_tracking_and_the_search_of_a_limb(monkeypatch: pytest.MonkeyPatch) -> None:
    """A live tracker whose first lost limb is compiled for stops for many seconds."""
    searched = Mock(wraps=limb_search.place_limb)
    monkeypatch.setattr(limb_search, "place_limb", searched)
    assert load_compiled(replace(tracker_setup(4), anatomy=FOURTEEN_PARTS, options=SMALL)) == "tracking"
    assert searched.called


@pytest.mark.slow
@pytest.mark.parametrize(("z", "words"), [(20.0, "tracking, front or back is not certain"), (-6.0, "waiting for a person")])
def test_warm_up_accepts_cameras_without_view_of_the_origin(z: float, words: str) -> None:
    """Far away, or with the person behind them."""
    setup, away = tracker_setup(3), np.array([0.0, 0.0, z])
    moved = {viewer: replace(camera, translation=camera.translation + away) for viewer, camera in setup.cameras.items()}
    assert load_compiled(replace(setup, anatomy=FOURTEEN_PARTS, cameras=moved, options=SMALL)) == words
