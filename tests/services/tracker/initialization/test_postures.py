"""Postures from which a search starts: those on the floor rest there."""

import numpy as np
import pytest

from tests.support.anatomies import each_anatomy
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import model_of
from zenocap.services.tracker.initialization.postures import FLOOR, corners, floor_postures, floor_start, search_postures


@each_anatomy
def test_search_postures_differ_for_every_anatomy(anatomy: Anatomy) -> None:
    postures = search_postures(anatomy)
    assert len(postures) == 5
    assert len({posture.values.tobytes() for posture in postures}) == 5


@each_anatomy
@pytest.mark.parametrize("height", [0.3, 0.9, 1.4])
def test_floor_postures_rest_on_the_floor_the_nearest_in_height_first(anatomy: Anatomy, height: float) -> None:
    body, place = average_body(anatomy, 1.75), np.array([0.4, 0.02, -0.7])
    model = model_of(anatomy, body)
    postures, heights = floor_postures(anatomy, model, height, len(FLOOR)), list[float]()
    for posture in postures:
        for yaw in (0.0, 0.5 * np.pi, np.pi):
            low, high = corners(model, floor_start(posture, place, yaw))
            np.testing.assert_allclose([*0.5 * (low + high)[[0, 2]], low[1]], place[[0, 2, 1]], atol=1e-9)
        assert np.all(joint_centres(anatomy, body, posture.pose(anatomy))[:, 1] > 0.0)
        heights.append(high[1] - low[1])
    assert np.all(np.diff(np.abs(np.array(heights) - height)) > -1e-9)
    assert max(heights) < 0.8 * 1.75
    assert len({one.values.tobytes() + one.rotation.tobytes() for one in postures}) == len(FLOOR) == 8
