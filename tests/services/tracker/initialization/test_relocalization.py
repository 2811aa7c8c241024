"""A measured body is found in common postures and any heading; a wrong heading is reversed."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.support.tracker_ring import rendered_masks, ring, seen, setup, simulated_person, t_pose_at
from zenocap.common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, Anatomy
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose, model_of
from zenocap.services.tracker.evidence.evidence import Evidence, misfit, support_fraction
from zenocap.services.tracker.filter.filter_step import residual_weights, start_tracking
from zenocap.services.tracker.initialization.heading import reversed_pose
from zenocap.services.tracker.initialization.localization import TPose, detect_t_pose
from zenocap.services.tracker.initialization.relocalization import best_pose_anywhere, check_other_postures, search_postures
from zenocap.services.tracker.initialization.t_pose import TPoseFit, fit_t_poses
from zenocap.services.tracker.parameters import PARTICLE_HOLD, T_POSE_HOLD
from zenocap.services.tracker.states import TrackedPerson
from zenocap.simulation.body.pose import PersonPose, Placement, neutral, place
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import motion_timeline

CAMERAS = ring(4)
SEED = 2
WEIGHTS = residual_weights(setup(CAMERAS), PARTICLE_HOLD)
HELD = residual_weights(setup(CAMERAS), T_POSE_HOLD)


@lru_cache
def model() -> BodyModel:
    evidence = shown(t_pose_at(SEED))
    one = detect_t_pose(evidence.rays)
    assert isinstance(one, TPose)
    start = fit_t_poses(FOURTEEN_PARTS, [evidence], [one], HELD)
    assert isinstance(start, TPoseFit)
    return model_of(FOURTEEN_PARTS, start.measured.body)


def shown(pose: PersonPose | None) -> Evidence:
    return seen(CAMERAS, list(rendered_masks(CAMERAS, SEED, pose).values()))


def find(evidence: Evidence, facing: RootedPose | None = None) -> RootedPose | None:
    preferred = None if facing is None else facing.rotation
    return best_pose_anywhere(setup(CAMERAS), person(), None, preferred, evidence)


def person() -> TrackedPerson:
    height = simulated_person(SEED).height
    one = TrackedPerson.of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, height), height)
    return replace(one, model=model(), expected_support=0.7)


def forward(yaw: float) -> np.ndarray:
    return np.array([np.sin(yaw), 0.0, np.cos(yaw)])


@pytest.mark.nightly
@pytest.mark.parametrize("yaw", np.linspace(0.0, 2 * np.pi, 5)[:-1] + 0.3)
def test_standing_person_is_found_in_any_heading(yaw: float) -> None:
    pose = place(neutral(simulated_person(SEED)), Placement(0.4, 0.3, yaw))
    found = find(*shown(pose))
    assert found is not None
    assert np.linalg.norm(found.position - truth(simulated_person(SEED), pose).joints["Hip"]) < 0.08
    assert found.rotation[:, 2] @ forward(yaw) > 0.9


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["walking", "running", "boxing"])
def test_moving_person_is_found(name: str) -> None:
    script = motion_timeline(simulated_person(SEED), name, 0)
    for later_s in (0.5, 1.1):
        pose = script.pose_at(script.motion_from_s + later_s)
        assert pose is not None
        evidence = shown(pose)
        found = find(evidence)
        assert found is not None
        assert np.linalg.norm(found.position - truth(simulated_person(SEED), pose).joints["Hip"]) < 0.12
        assert support_fraction(model(), evidence, found) > 0.5


@pytest.mark.nightly
def test_empty_scene_gives_no_pose() -> None:
    assert find(shown(None)) is None


@pytest.mark.nightly
def test_preferred_heading_wins_unless_it_fits_worse() -> None:
    pose = place(neutral(simulated_person(SEED)), Placement(0.0, 0.0, 0.3))
    evidence = shown(pose)
    free = find(evidence)
    assert free is not None
    with_it, against_it = find(evidence, free), find(evidence, RootedPose(free.position, -free.rotation, free.values))
    assert with_it is not None
    assert against_it is not None
    np.testing.assert_array_equal(with_it.rotation, free.rotation)
    assert misfit(model(), evidence, WEIGHTS.limit, against_it) <= 1.3 * misfit(model(), evidence, WEIGHTS.limit, free)


def test_reversed_pose_fits_better_than_a_wrong_heading() -> None:
    script = motion_timeline(simulated_person(SEED), "walking", 0)
    pose = script.pose_at(script.motion_from_s + 0.5)
    assert pose is not None
    evidence = shown(pose)
    right = find(evidence)
    assert right is not None
    wrong = reversed_pose(setup(CAMERAS), model(), evidence, right, search_postures(FOURTEEN_PARTS))
    again = reversed_pose(setup(CAMERAS), model(), evidence, wrong, search_postures(FOURTEEN_PARTS))
    assert wrong.rotation[:, 2] @ right.rotation[:, 2] < 0.0
    assert misfit(model(), evidence, WEIGHTS.limit, right) < misfit(model(), evidence, WEIGHTS.limit, wrong)
    assert again.rotation[:, 2] @ right.rotation[:, 2] > 0.8


@pytest.mark.parametrize("anatomy", ANATOMIES.values(), ids=ANATOMIES)
def test_search_postures_differ_for_every_anatomy(anatomy: Anatomy) -> None:
    postures = search_postures(anatomy)
    assert len(postures) == 5
    assert len({posture.values.tobytes() for posture in postures}) == 5


@pytest.mark.slow
def test_common_posture_replaces_a_pose_that_fits_worse_and_keeps_one_that_fits() -> None:
    standing = place(neutral(simulated_person(SEED)), Placement(0.1, 0.2, 0.4))
    evidence = shown(standing)
    config = setup(CAMERAS)
    right = find(evidence)
    assert right is not None
    wrong = right._replace(values=search_postures(FOURTEEN_PARTS)[0].values.copy())  # arms stretched
    for pose, replaced in ((wrong, True), (right, False)):
        tracking, outcome = start_tracking(config, person(), pose, 0, 0.0)
        after, _ = check_other_postures(config, tracking, outcome, 33, evidence)
        assert (after.cloud is not tracking.cloud) == replaced
        assert np.abs(after.estimate.values - right.values).max() < 0.5
        assert after.corrected_ns == (33 if replaced else 0)
