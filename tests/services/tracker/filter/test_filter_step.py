"""One step of the filter on scenes of a known pose: convergence, prediction, track loss."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.tracker_scenes import MODEL, STATURE_M, apart, moved, rays_alone, tangent_rays, upright
from tests.support.tracker_stand_in import FRAME_NS, cameras
from zenocap.common.arrays import Floats32
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.filter.filter_step import filter_step, start_tracking
from zenocap.services.tracker.initialization.postures import turned_start
from zenocap.services.tracker.parameters import LOST_FRAMES, MIN_TRACKING_RAYS, TURN_DAMPING, TURN_RATE
from zenocap.services.tracker.states import Lost, Options, Outcome, TrackedPerson, TrackerSetup, Tracking

PERSON = replace(TrackedPerson.of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, STATURE_M), STATURE_M), expected_support=0.9)
TRUE = upright(seed=4)
ALONG_X = np.array([1.0, 0.0, 0.0])
AWAY = TRUE._replace(position=TRUE.position + 3.0 * ALONG_X)
SEEDS = range(5)


@cache
def seen() -> Floats32:
    return tangent_rays(MODEL, TRUE, 400)


def setup_with(**options: object) -> TrackerSetup:
    return TrackerSetup(FOURTEEN_PARTS, cameras(4), FRAME_NS, None, replace(Options(), **options))  # type: ignore[arg-type]


def error_mm(pose: RootedPose, true: RootedPose = TRUE) -> float:
    return 1000.0 * float(apart(MODEL, pose, true).mean())


def steps(
    setup: TrackerSetup, start: RootedPose, scenes: list[Floats32], seed: int = 0
) -> list[tuple[Tracking | Lost, Outcome]]:
    phase, _ = start_tracking(setup, PERSON, start, 0, 0.0)
    results: list[tuple[Tracking | Lost, Outcome]] = []
    for k, scene in enumerate(scenes, 1):
        results.append(filter_step(setup, phase, k * FRAME_NS, rays_alone(scene), np.random.default_rng([seed, k])))
        phase = results[-1][0]
    return results


@pytest.mark.parametrize("seed", SEEDS)
def test_filter_converges_from_a_nearby_pose(seed: int) -> None:
    start = moved(TRUE, np.random.default_rng(seed), 0.03, 0.12)
    results = steps(setup_with(), start, [seen()] * 4, seed)
    assert error_mm(results[-1][0].estimate) < min(12.0, 0.3 * error_mm(start))
    assert not results[-1][1].lost


@pytest.mark.parametrize("seed", SEEDS)
def test_particles_without_refinement_are_worse(seed: int) -> None:
    """The paper's Table II: 1000 particles, sampled and weighted only."""
    start = moved(TRUE, np.random.default_rng(seed), 0.03, 0.12)
    refined = steps(setup_with(), start, [seen()] * 2, seed)[-1][0].estimate
    sampled = steps(setup_with(method="particle-filter", particles=1000), start, [seen()] * 2, seed)[-1][0].estimate
    assert error_mm(refined) < 0.5 * error_mm(sampled)


@pytest.mark.slow
def test_baselines_do_not_search_limbs() -> None:
    image_force = setup_with(method="image-force", particles=1)
    found = steps(image_force, TRUE, [seen()] * 3)[-1][0]
    assert found.limb_support is None


@pytest.mark.nightly
def test_prediction_continues_the_motion() -> None:
    poses = [TRUE._replace(position=TRUE.position + 0.05 * k * ALONG_X) for k in range(7)]
    results = steps(setup_with(), TRUE, [tangent_rays(MODEL, pose, 400) for pose in poses[1:]])
    assert error_mm(results[-1][0].estimate, poses[-1]) < 12.0
    assert results[-1][0].velocity[0] * FRAME_NS / 1e9 == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize(
    ("frames", "turn", "turned"), [(1, 1.6, 1.6 * TURN_DAMPING), (30, 0.2, 0.2 * TURN_DAMPING / TURN_RATE)]
)
def test_turn_of_the_trunk_goes_on_for_a_few_frames(frames: int, turn: float, turned: float) -> None:
    start, _ = start_tracking(setup_with(), PERSON, TRUE, 0, 0.0)
    velocity = np.zeros_like(start.velocity)
    velocity[4] = turn * 1e9 / FRAME_NS  # about the vertical, rad/s
    seen_turned = rays_alone(tangent_rays(MODEL, turned_start(TRUE, TRUE.position, turned), 400))
    rng = np.random.default_rng(0)
    phase, _ = filter_step(setup_with(), replace(start, velocity=velocity), frames * FRAME_NS, seen_turned, rng)
    assert error_mm(phase.estimate, turned_start(TRUE, TRUE.position, turned)) < 12.0


def test_empty_frames_keep_the_particles_and_report_track_loss() -> None:
    few = seen()[:, : MIN_TRACKING_RAYS - 1]
    phase, outcome = steps(setup_with(), TRUE, [few])[0]
    assert phase.misfits_in_row == 1
    assert outcome.lost
    assert outcome.pose is None
    assert error_mm(phase.estimate) == 0.0
    results = steps(setup_with(), TRUE, [few] * (10 * LOST_FRAMES))
    assert [k for k, (phase, _) in enumerate(results, 1) if isinstance(phase, Lost)] == [10 * LOST_FRAMES]


@pytest.mark.slow
def test_track_is_lost_after_consecutive_misfits() -> None:
    results = steps(setup_with(), TRUE, [tangent_rays(MODEL, AWAY, 400)] * LOST_FRAMES)
    assert [isinstance(phase, Lost) for phase, _ in results] == [False] * (LOST_FRAMES - 1) + [True]
    assert results[-1][1].lost


@pytest.mark.slow
def test_tracking_continues_after_one_misfit() -> None:
    results = steps(setup_with(), TRUE, [seen(), tangent_rays(MODEL, AWAY, 400), seen(), seen(), seen()])
    assert [phase.misfits_in_row for phase, _ in results] == [0, 1, 0, 0, 0]
    assert error_mm(results[-1][0].estimate) < 12.0


@pytest.mark.slow
def test_unobserved_part_stays_at_the_prediction_with_larger_spread() -> None:
    """Rays of everything but the left forearm."""
    names = FOURTEEN_PARTS.parts
    hidden = names.index("left_lower_arm")
    scene = tangent_rays(MODEL, TRUE, 400, parts=tuple(k for k in range(len(names)) if k != hidden))
    phase, outcome = steps(setup_with(), TRUE, [scene] * 5)[-1]
    assert error_mm(phase.estimate) < 12.0
    at = FOURTEEN_PARTS.index
    assert outcome.spread[at["left_elbow.x"]] > 1.5 * outcome.spread[at["right_elbow.x"]]


@pytest.mark.parametrize("method", ["hybrid", "particle-filter"])
def test_runs_are_equal_exactly_when_seeds_are(method: str) -> None:
    setup, start = setup_with(method=method), moved(TRUE, np.random.default_rng(0), 0.02, 0.08)
    one, again, other = (steps(setup, start, [seen()] * 2, seed)[-1][0].cloud.values for seed in (1, 1, 2))
    assert one.tobytes() == again.tobytes()
    assert not np.array_equal(one, other)


def test_weights_sum_to_one_and_give_the_effective_number() -> None:
    phase, outcome = steps(setup_with(), moved(TRUE, np.random.default_rng(1), 0.02, 0.05), [seen()])[0]
    weights = phase.cloud.weights
    assert weights.sum() == pytest.approx(1.0)
    assert outcome.effective == pytest.approx(1.0 / np.sum(weights**2))
    assert 1.0 <= outcome.effective <= len(weights)
    assert 0.0 < outcome.likelihood <= 1.0
