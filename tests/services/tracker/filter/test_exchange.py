"""Exchange of left and right limbs: the exchanged pose, and the gain over several frames."""

import numpy as np
import pytest

from tests.support.tracker_scenes import tangent_rays, upright
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.coordinates import coordinates_of
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.filter.correspondence import Weights
from zenocap.services.tracker.filter.exchange import columns_of, exchanged, try_exchanges
from zenocap.services.tracker.filter.particles import RefinementScene
from zenocap.services.tracker.hull.silhouette_distance import no_distance_field
from zenocap.services.tracker.parameters import EXCHANGE_GAIN, EXCHANGE_RATE

NAMES = coordinates_of(FOURTEEN_PARTS).names
MODEL = model_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
WEIGHTS = Weights(0.01, 0.15, np.full(6 + len(NAMES), 1.0 / 0.4**2), 0.25)


def arm_forward() -> RootedPose:
    """Standing, the right arm raised forward, the left one hanging."""
    pose = upright(FOURTEEN_PARTS, 1, spread=0.0)
    pose.values[NAMES.index("right_shoulder.1")] -= 1.4
    return pose


def scene_of(pose: RootedPose) -> RefinementScene:
    return RefinementScene(MODEL, tangent_rays(MODEL, pose, 500), no_distance_field(), WEIGHTS)


def test_exchanged_twice_is_the_pose() -> None:
    pose = arm_forward()
    for pair in (0, 1):
        twice = exchanged(FOURTEEN_PARTS, exchanged(FOURTEEN_PARTS, pose, pair), pair)
        assert twice.values == pytest.approx(pose.values)
    assert np.array_equal(
        exchanged(FOURTEEN_PARTS, pose, 1).values[columns_of(FOURTEEN_PARTS)[0]], pose.values[columns_of(FOURTEEN_PARTS)[0]]
    )


def test_pairs_have_the_coordinates_of_both_limbs() -> None:
    arms, legs = ({NAMES[k].partition(".")[0] for k in columns} for columns in columns_of(FOURTEEN_PARTS))
    assert {"right_shoulder", "left_shoulder", "right_elbow", "left_elbow"} <= arms
    assert {"right_hip", "left_hip", "right_knee", "left_knee"} <= legs
    assert not arms & legs


def test_the_wrong_arm_is_exchanged_after_some_frames() -> None:
    true = arm_forward()
    wrong, gains, frames = exchanged(FOURTEEN_PARTS, true, 0), np.zeros(2), 0
    scene = scene_of(true)
    while gains.max() <= EXCHANGE_GAIN:
        found = try_exchanges(FOURTEEN_PARTS, scene, wrong, gains)
        gains, frames = found.gains, frames + 1
        assert frames < 10
    assert found.pose is not None
    assert found.pose.values == pytest.approx(true.values, abs=0.15)


def test_the_right_arm_is_kept() -> None:
    true, gains = arm_forward(), np.zeros(2)
    scene = scene_of(true)
    for _ in range(10):
        gains = try_exchanges(FOURTEEN_PARTS, scene, true, gains).gains
    assert gains[0] < 0.0


def test_limbs_that_are_alike_are_not_tried() -> None:
    """And an earlier gain fades."""
    standing, gains = upright(FOURTEEN_PARTS, 1, spread=0.0), np.array([0.04, 0.0])
    found = try_exchanges(FOURTEEN_PARTS, scene_of(standing), standing, gains)
    faded: Floats = (1.0 - EXCHANGE_RATE) * gains
    assert found.pose is None
    assert found.gains == pytest.approx(faded)
