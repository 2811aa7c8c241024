"""Phases of tracking one person: waiting, measurement, tracking, loss, relocalization."""

from collections.abc import Iterable
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import STANDING, tracking
from tests.support.anatomies import each_anatomy
from tests.support.tracker_ring import (
    FRAME_NS,
    hip_error,
    in_motion,
    played,
    rendered_masks,
    ring,
    setup,
    simulated_person,
    standing_at,
    t_pose_at,
)
from zenocap.common.body.anatomy import ANATOMIES, Anatomy
from zenocap.common.body.definition import Pose
from zenocap.common.rig.tracker import PRESETS, find_prior
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.parameters import LOST_FRAMES
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.states import Method, Options, Outcome, TrackerSetup, TrackState
from zenocap.services.tracker.tracking import initial_state, other_postures_period, resume, track
from zenocap.simulation.body.pose import PersonPose

CAMERAS = ring(4)
SEED = 3
Played = tuple[TrackState, list[Outcome], list[str]]


def run(
    config: TrackerSetup, poses: Iterable[PersonPose | None], state: TrackState | None = None, start: int = 0
) -> Played:
    return played(config, SEED, poses, state, start)


def error(outcome: Outcome, pose: PersonPose) -> float:
    return hip_error(SEED, outcome.pose.position, pose)


@pytest.fixture(scope="module")
def started() -> Played:
    return run(setup(CAMERAS), [None, *[t_pose_at(SEED)] * 5])


@pytest.mark.slow
def test_person_is_awaited_measured_and_tracked(started: Played) -> None:
    _, outcomes, texts = started
    measuring = [f"measuring the body ({count} of 4)" for count in (1, 2, 3)]
    assert texts == ["waiting for a person", *measuring, "tracking", "tracking"]
    assert [k for k, outcome in enumerate(outcomes) if outcome.body is not None] == [4]
    assert [k for k, outcome in enumerate(outcomes) if outcome.pose is not None] == [4, 5]
    assert error(outcomes[5], t_pose_at(SEED)) < 0.06


def test_health_text_names_the_missing_step() -> None:
    _, outcomes, texts = run(setup(CAMERAS), [standing_at(SEED)])
    assert texts[0].startswith("no T-pose: hold both arms out sideways")
    assert outcomes[0].pose is None
    assert not outcomes[0].lost


def test_motion_restarts_the_measurement() -> None:
    _, _, texts = run(setup(CAMERAS), [t_pose_at(SEED), t_pose_at(SEED), t_pose_at(SEED, x=0.4)])
    assert texts == ["measuring the body (1 of 4)", "measuring the body (2 of 4)", "measuring the body (1 of 4)"]


@pytest.mark.slow
def test_two_runs_of_one_seed_are_equal(started: Played) -> None:
    state, _, _ = started
    (_, one, _), (_, other, _) = (run(setup(CAMERAS), in_motion(SEED, 4), state, 6) for _ in range(2))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.pose.angles, b.pose.angles)
        np.testing.assert_array_equal(a.spread, b.spread)


def test_another_seed_gives_another_cloud(started: Played) -> None:
    state, _, _ = started
    _, one, _ = run(setup(CAMERAS), [t_pose_at(SEED)], state, 6)
    _, other, _ = run(setup(CAMERAS, seed=1), [t_pose_at(SEED)], state, 6)
    assert not np.array_equal(one[0].spread, other[0].spread)


def test_tracking_continues_after_ten_empty_frame_sets(started: Played) -> None:
    state, _, _ = started
    _, outcomes, _ = run(setup(CAMERAS), [*[None] * 10, *[t_pose_at(SEED, x=0.05)] * 2], state, 6)
    assert all(outcome.lost and outcome.pose is None for outcome in outcomes[:10])
    assert error(outcomes[-1], t_pose_at(SEED, x=0.05)) < 0.06


def test_a_person_who_leaves_is_searched_for_and_found_at_another_position(started: Played) -> None:
    state, _, _ = started
    state, gone, texts = run(setup(CAMERAS), [None] * 61, state, 6)
    assert texts[-1] == "searching for the person"
    assert gone[-1].lost
    back = standing_at(SEED, -0.5, 0.4, 0.6)
    _, outcomes, texts = run(setup(CAMERAS), [back] * 16, state, 67)
    assert texts[0].startswith("tracking")
    assert texts[-1] == "tracking"  # and no other heading fits
    assert error(outcomes[-1], back) < 0.08
    assert outcomes[0].body is None  # it is the same person


@pytest.mark.slow
def test_a_person_at_a_suddenly_different_position_is_found(started: Played) -> None:
    state, _, _ = started
    there = standing_at(SEED, 0.9, -0.6, -0.4)
    _, outcomes, texts = run(setup(CAMERAS), [there] * 4, state, 6)
    assert texts[-1] == "tracking"
    assert error(outcomes[-1], there) < 0.08


def test_known_height_needs_no_initial_posture() -> None:
    here = standing_at(SEED, 0.3, 0.2, 0.5)
    _, outcomes, texts = run(setup(CAMERAS, person_height=simulated_person(SEED).height), [here] * 3)
    assert texts[0].startswith("tracking with average proportions: hold the T-pose to measure the body")
    assert outcomes[0].body is not None
    assert not outcomes[-1].measured
    assert error(outcomes[-1], here) < 0.08


def test_the_t_pose_measures_a_person_of_known_height_as_any_other() -> None:
    here = [t_pose_at(SEED)] * 5
    _, expected, _ = run(setup(CAMERAS), here)
    _, outcomes, texts = run(setup(CAMERAS, person_height=1.1 * simulated_person(SEED).height), here)
    assert texts[-1] == "tracking"
    assert outcomes[0].pose is not None
    assert outcomes[-1].measured
    body, other = (next(one.body for one in reversed(found) if one.body is not None) for found in (outcomes, expected))
    np.testing.assert_array_equal(body.offsets, other.offsets)


def test_a_missing_viewer_is_not_used(started: Played) -> None:
    state, _, _ = started
    masks = rendered_masks(CAMERAS, SEED, t_pose_at(SEED))
    _, outcome = track(setup(CAMERAS), state, 6 * FRAME_NS, {viewer: masks[viewer] for viewer in ("1", "2", "4")})
    assert outcome.views == ("1", "2", "4")
    assert error(outcome, t_pose_at(SEED)) < 0.06


@pytest.mark.nightly
@pytest.mark.parametrize("method", get_args(Method))
def test_preset_paper_tracks_a_walking_person_and_never_relocalizes(method: Method) -> None:
    anatomy = ANATOMIES[PRESETS["paper"].anatomy]
    prior = read_prior(find_prior("walking-paper"), anatomy) if method == "hybrid" else None
    particles = {"hybrid": 4, "image-force": 1, "particle-filter": 50}[method]
    options = Options(method, particles, 300, 30, 0, "force-printed", PRESETS["paper"].filter)
    config = TrackerSetup(anatomy, CAMERAS, FRAME_NS, prior, options)
    state, _, texts = run(config, [t_pose_at(SEED)] * 5)
    assert texts[-1] == "tracking"
    state, outcomes, _ = run(config, [t_pose_at(SEED, x=0.03), *in_motion(SEED, 3)], state, 5)
    assert error(outcomes[0], t_pose_at(SEED, x=0.03)) < 0.08
    assert all(outcome.pose is not None and outcome.body is None for outcome in outcomes)
    away = standing_at(SEED, -1.5, 1.0, 0.6)
    _, outcomes, texts = run(config, [away] * (LOST_FRAMES + 1), state, 9)
    assert texts[-1] == "tracking, the body does not fit the scene"
    assert not any(outcome.lost for outcome in outcomes)


@each_anatomy
def test_a_restart_derives_the_stature_from_the_body(anatomy: Anatomy) -> None:
    one = replace(setup(ring(2)), anatomy=anatomy)
    state = resume(one, initial_state(one), average_body(anatomy, 1.62), Pose(np.zeros(3), anatomy.neutral), 0)
    assert state.phase.person.stature == pytest.approx(1.62)


def test_other_postures_are_tried_seldom_only_while_heading_and_limbs_are_sure() -> None:
    sure = np.tile([1.0, 1.0, -7.0, 1.0, 0.0], (4, 1))
    doubtful = sure - np.outer([0, 0, 0, 1], [0, 0, 0, 0, -0.5])
    for known, features, period in ((True, sure, 6), (True, doubtful, 3), (False, sure, 3), (True, None, 3)):
        phase = replace(tracking(STANDING, known), limb_features=features)
        assert other_postures_period(phase) == period


@pytest.mark.slow
def test_confidence_is_stated_only_where_the_tracker_looks_for_what_it_rests_on(started: Played) -> None:
    _, outcomes, _ = started
    assert outcomes[-1].limb_features is not None
    assert outcomes[-1].toes is not None
    config = setup(CAMERAS)
    printed = replace(config, options=replace(config.options, filter=PRESETS["paper"].filter, iterations=2))
    _, outcomes, _ = run(printed, [None, *[t_pose_at(SEED)] * 5])
    assert outcomes[-1].pose is not None
    assert outcomes[-1].limb_features is None
    assert outcomes[-1].toes is None
