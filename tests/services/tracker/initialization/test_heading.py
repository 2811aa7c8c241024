"""Front and back from the feet: reach, running mean."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.tracker_ring import ring, setup
from tests.support.tracker_scenes import MODEL, STATURE_M, average_model, in_t_pose, tangent_rays
from zenocap.common.arrays import Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.proportions import HIP_HEIGHT
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.filter.filter_step import start_tracking
from zenocap.services.tracker.hull.contour_rays import midpoints
from zenocap.services.tracker.initialization.heading import foot_reach, with_toes
from zenocap.services.tracker.initialization.postures import floor_postures, floor_start
from zenocap.services.tracker.parameters import HEADING_TOES
from zenocap.services.tracker.states import TrackedPerson, Tracking
from zenocap.services.tracker.tracking import describe, initial_state

BODY = average_body(FOURTEEN_PARTS, STATURE_M)


@cache
def rays() -> Floats32:
    return tangent_rays(MODEL, STANDING, 600)


def standing(anatomy: Anatomy) -> RootedPose:
    """In the T-pose, facing between +Z and +X."""
    return in_t_pose(anatomy, [0.1, HIP_HEIGHT * STATURE_M, 0.2], yaw=0.5)


STANDING = standing(FOURTEEN_PARTS)
SETUP = setup(ring(4))


def reversed_of(pose: RootedPose) -> RootedPose:
    return pose._replace(rotation=pose.rotation @ np.diag([-1.0, 1.0, -1.0]))


def tracking(pose: RootedPose, known: bool = False) -> Tracking:
    person = replace(TrackedPerson.of(FOURTEEN_PARTS, BODY, STATURE_M), expected_support=0.8, heading_known=known)
    return start_tracking(SETUP, person, pose, 0, 0.0)[0]


@pytest.mark.parametrize("anatomy", [FOURTEEN_PARTS, TEN_PARTS], ids=["feet", "no feet"])
def test_feet_reach_forward_and_for_a_reversed_pose_backwards(anatomy: Anatomy) -> None:
    model, pose = average_model(anatomy), standing(anatomy)
    assert foot_reach(anatomy, model, rays(), pose, STATURE_M) > 0.03
    assert foot_reach(anatomy, model, rays(), reversed_of(pose), STATURE_M) < -0.03


def test_feet_of_one_who_lies_show_nothing() -> None:
    lying = floor_start(floor_postures(FOURTEEN_PARTS, MODEL, 0.3, 1)[0], np.zeros(3), 0.5)
    assert foot_reach(FOURTEEN_PARTS, MODEL, tangent_rays(MODEL, lying, 600), lying, STATURE_M) is None


def test_without_feet_in_the_scene_nothing_changes() -> None:
    above = np.ascontiguousarray(rays()[:, midpoints(rays())[:, 1] > 0.3])
    phase = tracking(STANDING)
    assert foot_reach(FOURTEEN_PARTS, MODEL, above, STANDING, STATURE_M) is None
    assert with_toes(FOURTEEN_PARTS, phase, above, alone=True) is phase


@pytest.mark.parametrize("alone", [True, False])
def test_heading_becomes_known_from_the_feet_alone(alone: bool) -> None:
    phase = tracking(STANDING)
    for _ in range(20):
        phase = with_toes(FOURTEEN_PARTS, phase, rays(), alone=alone)
    assert phase.toes > HEADING_TOES
    assert phase.person.heading_known == alone


def test_health_says_that_front_or_back_is_not_certain() -> None:
    state = initial_state(SETUP)
    for known, toes, words in (
        (True, 0.9 * HEADING_TOES, "tracking, front or back is not certain"),
        (False, HEADING_TOES, "tracking, front or back is not certain"),
        (True, HEADING_TOES, "tracking"),
    ):
        assert describe(replace(state, phase=replace(tracking(STANDING, known), toes=toes))) == words
