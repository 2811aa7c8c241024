"""A measured body is found in common postures and any heading; a wrong heading is reversed."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support import tracker_ring
from tests.support.tracker_scenes import MODEL, rays_alone, tangent_rays
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, model_of
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.filter.filter_step import residual_weights, start_tracking
from zenocap.services.tracker.initialization.postures import floor_postures, floor_start, search_postures
from zenocap.services.tracker.initialization.relocalization import check_other_postures, poses_anywhere, search
from zenocap.services.tracker.initialization.twins import exchanged
from zenocap.services.tracker.parameters import PARTICLE_HOLD, RETRY_FRAMES, SEARCH_PASSES
from zenocap.services.tracker.states import Lost, TrackedPerson, Tracking
from zenocap.simulation.body.pose import PersonPose

SETUP = tracker_ring.setup(tracker_ring.ring(4))
SEED = 2
WEIGHTS = residual_weights(SETUP, PARTICLE_HOLD)


@lru_cache
def model() -> BodyModel:
    return model_of(FOURTEEN_PARTS, tracker_ring.fit_of(SETUP, of_pose(tracker_ring.t_pose_at(SEED))).measured.body)


def of_pose(pose: PersonPose | None) -> Evidence:
    return tracker_ring.shown(SETUP.cameras, SEED, pose)


def find(evidence: Evidence, rotation: Floats | None = None) -> RootedPose | None:
    return next(iter(poses_anywhere(SETUP, person(), None, rotation, evidence)), None)


def person() -> TrackedPerson:
    height = tracker_ring.simulated_person(SEED).height
    one = TrackedPerson.of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, height), height)
    return replace(one, model=model(), expected_support=0.7)


@pytest.mark.nightly
@pytest.mark.parametrize("yaw", np.linspace(0.0, 2 * np.pi, 5)[:-1] + 0.3)
def test_standing_person_is_found_in_any_heading(yaw: float) -> None:
    pose = tracker_ring.standing_at(SEED, 0.4, 0.3, yaw)
    found = find(of_pose(pose))
    assert tracker_ring.hip_error(SEED, found.position, pose) < 0.08
    assert found.rotation[:, 2] @ tracker_ring.ahead(yaw) > 0.9


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["walking", "running", "boxing"])
def test_moving_person_is_found(name: str) -> None:
    for later_s in (0.5, 1.1):
        (pose,) = tracker_ring.in_motion(SEED, 1, name, later_s)
        evidence = of_pose(pose)
        found = find(evidence)
        assert tracker_ring.hip_error(SEED, found.position, pose) < 0.12
        assert support_fraction(model(), evidence, found) > 0.5


@pytest.mark.nightly
def test_empty_scene_gives_no_pose() -> None:
    assert find(of_pose(None)) is None


@pytest.mark.nightly
def test_preferred_heading_wins_unless_it_fits_worse() -> None:
    evidence = of_pose(tracker_ring.standing_at(SEED, yaw=0.3))
    free = find(evidence)
    with_it, against_it = find(evidence, free.rotation), find(evidence, -free.rotation)
    np.testing.assert_array_equal(with_it.rotation, free.rotation)
    assert misfit(model(), evidence, WEIGHTS.limit, against_it) <= 1.3 * misfit(model(), evidence, WEIGHTS.limit, free)


def test_reversed_pose_fits_better_than_a_wrong_heading() -> None:
    evidence = of_pose(*tracker_ring.in_motion(SEED, 1, from_s=0.5))
    right = find(evidence)
    wrong = exchanged(SETUP, person(), evidence, right, "back", SEARCH_PASSES)
    again = exchanged(SETUP, person(), evidence, wrong, "back", SEARCH_PASSES)
    assert wrong.rotation[:, 2] @ right.rotation[:, 2] < 0.0
    assert misfit(model(), evidence, WEIGHTS.limit, right) < misfit(model(), evidence, WEIGHTS.limit, wrong)
    assert again.rotation[:, 2] @ right.rotation[:, 2] > 0.8


def test_lost_person_on_the_floor_is_found_in_every_second_search() -> None:
    lying = floor_start(floor_postures(FOURTEEN_PARTS, MODEL, 0.3, 1)[0], np.array([0.3, 0.0, -0.2]), 0.9)
    evidence, found = rays_alone(tangent_rays(MODEL, lying, 300)), None
    phase: Lost | Tracking = Lost(replace(person(), model=MODEL), None)
    for k in range(2 * (RETRY_FRAMES + 1)):
        assert isinstance(phase, Lost)
        phase, _ = search(SETUP, phase, k, evidence)
        if isinstance(phase, Tracking):
            found = k
            break
    assert found == RETRY_FRAMES + 1
    np.testing.assert_allclose(phase.estimate.position, lying.position, atol=0.05)
    assert phase.estimate.rotation[:, 1] @ lying.rotation[:, 1] > 0.95


@pytest.mark.slow
def test_common_posture_replaces_a_pose_that_fits_worse_and_keeps_one_that_fits() -> None:
    evidence = of_pose(tracker_ring.standing_at(SEED, 0.1, 0.2, 0.4))
    right = find(evidence)
    wrong = right._replace(values=search_postures(FOURTEEN_PARTS)[0].values.copy())  # arms stretched
    for pose, replaced in ((wrong, True), (right, False)):
        tracking, outcome = start_tracking(SETUP, person(), pose, 0, 0.0)
        after, _ = check_other_postures(SETUP, tracking, outcome, 33, evidence)
        assert (after.cloud is not tracking.cloud) == replaced
        assert np.abs(after.estimate.values - right.values).max() < 0.5
        assert after.corrected_ns == (33 if replaced else 0)
