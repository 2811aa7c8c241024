"""One step of the filter on scenes whose pose is known: it follows, it waits, it knows when it has lost the person."""

from dataclasses import replace

import numpy as np
import pytest
from tracker_scenes import moved, positions_of, tangent_rays, upright
from tracker_stand_in import FRAME_NS, cameras

from common.body.anatomy import FOURTEEN_PARTS
from services.tracker.closest import Singles
from services.tracker.filtering import LEAST_RAYS, LOST_AFTER, advanced, begin
from services.tracker.knowledge import beginning
from services.tracker.model import model_of
from services.tracker.phases import Lost, Options, Outcome, Person, Setup, Tracking
from services.tracker.posed import Posed
from services.tracker.room import no_room
from services.tracker.sizes import COUNT
from services.tracker.stature import average_body

BODY = average_body(FOURTEEN_PARTS, 1.75)
MODEL = model_of(FOURTEEN_PARTS, BODY)
PERSON = Person(BODY, MODEL, 1.75, beginning(BODY, np.zeros(COUNT)), typical=0.9)
TRUE = upright(seed=4)
SCENE = tangent_rays(MODEL, TRUE, 400)
SEEDS = range(5)


def a_setup(**options: object) -> Setup:
    return Setup(FOURTEEN_PARTS, cameras(4), FRAME_NS, None, replace(Options(), **options))  # type: ignore[arg-type]


def error_mm(pose: Posed, true: Posed = TRUE) -> float:
    return 1000.0 * float(np.linalg.norm(positions_of(MODEL, pose) - positions_of(MODEL, true), axis=1).mean())


def steps(setup: Setup, start: Posed, scenes: list[Singles], seed: int = 0) -> list[tuple[Tracking | Lost, Outcome]]:
    phase: Tracking | Lost
    phase, _ = begin(setup, PERSON, start, 0, 0.0)
    made: list[tuple[Tracking | Lost, Outcome]] = []
    for k, scene in enumerate(scenes, 1):
        assert isinstance(phase, Tracking)
        made.append(advanced(setup, phase, k * FRAME_NS, scene, no_room(), np.random.default_rng([seed, k])))
        phase = made[-1][0]
    return made


def tracked(made: tuple[Tracking | Lost, Outcome]) -> Tracking:
    assert isinstance(made[0], Tracking)
    return made[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_it_comes_to_the_scene_from_nearby(seed: int) -> None:
    start = moved(TRUE, np.random.default_rng(seed), 0.03, 0.12)
    made = steps(a_setup(), start, [SCENE] * 4, seed)
    assert error_mm(tracked(made[-1]).estimate) < min(12.0, 0.3 * error_mm(start))
    assert not made[-1][1].lost


@pytest.mark.parametrize("seed", SEEDS)
def test_particles_without_refinement_are_worse(seed: int) -> None:
    """The paper's Table II: 1000 of them, sampled and weighted alone."""
    start = moved(TRUE, np.random.default_rng(seed), 0.03, 0.12)
    refined = tracked(steps(a_setup(), start, [SCENE] * 2, seed)[-1]).estimate
    sampled = tracked(steps(a_setup(method="particle-filter", particles=1000), start, [SCENE] * 2, seed)[-1]).estimate
    assert error_mm(refined) < 0.5 * error_mm(sampled)


def test_a_moving_person_is_expected_to_move_on() -> None:
    poses = [TRUE]
    for _ in range(6):
        last = poses[-1]
        poses.append(Posed(last.position + np.array([0.05, 0.0, 0.0]), last.rotation.copy(), last.values.copy()))
    made = steps(a_setup(), TRUE, [tangent_rays(MODEL, pose, 400) for pose in poses[1:]])
    assert error_mm(tracked(made[-1]).estimate, poses[-1]) < 12.0
    assert tracked(made[-1]).velocity[0] * FRAME_NS / 1e9 == pytest.approx(0.05, abs=0.01)


def test_without_a_scene_the_particles_wait_and_the_person_is_lost_meanwhile() -> None:
    few = SCENE[:, : LEAST_RAYS - 1]
    phase, outcome = steps(a_setup(), TRUE, [few])[0]
    assert isinstance(phase, Tracking)
    assert phase.bad == 1
    assert outcome.lost
    assert outcome.pose is None
    assert error_mm(phase.estimate) == 0.0
    made = steps(a_setup(), TRUE, [few] * (10 * LOST_AFTER))
    assert [k for k, (phase, _) in enumerate(made, 1) if isinstance(phase, Lost)] == [10 * LOST_AFTER]


def test_a_person_who_is_somewhere_else_is_lost_after_some_instants() -> None:
    away = Posed(TRUE.position + np.array([3.0, 0.0, 0.0]), TRUE.rotation, TRUE.values)
    made = steps(a_setup(), TRUE, [tangent_rays(MODEL, away, 400)] * LOST_AFTER)
    assert [isinstance(phase, Lost) for phase, _ in made] == [False] * (LOST_AFTER - 1) + [True]
    assert made[-1][1].lost


def test_after_one_bad_instant_it_goes_on() -> None:
    away = Posed(TRUE.position + np.array([3.0, 0.0, 0.0]), TRUE.rotation, TRUE.values)
    made = steps(a_setup(), TRUE, [SCENE, tangent_rays(MODEL, away, 400), SCENE, SCENE, SCENE])
    assert [tracked(one).bad for one in made] == [0, 1, 0, 0, 0]
    assert error_mm(tracked(made[-1]).estimate) < 12.0


def test_what_no_ray_touches_stays_as_expected_and_its_spread_is_larger() -> None:
    """Rays of everything but the left forearm."""
    names = FOURTEEN_PARTS.parts
    hidden = names.index("left_lower_arm")
    scene = tangent_rays(MODEL, TRUE, 400, parts=tuple(k for k in range(len(names)) if k != hidden))
    phase, outcome = steps(a_setup(), TRUE, [scene] * 5)[-1]
    assert isinstance(phase, Tracking)
    assert error_mm(phase.estimate) < 12.0
    at = FOURTEEN_PARTS.index
    assert outcome.spread[at["left_elbow.x"]] > 1.5 * outcome.spread[at["right_elbow.x"]]


@pytest.mark.parametrize("method", ["hybrid", "particle-filter"])
def test_two_runs_of_one_seed_are_equal_and_of_two_seeds_are_not(method: str) -> None:
    setup, start = a_setup(method=method), moved(TRUE, np.random.default_rng(0), 0.02, 0.08)
    one, again, other = (tracked(steps(setup, start, [SCENE] * 2, seed)[-1]) for seed in (1, 1, 2))
    assert one.cloud.values.tobytes() == again.cloud.values.tobytes()
    assert not np.array_equal(one.cloud.values, other.cloud.values)


def test_weights_add_up_and_tell_how_many_particles_count() -> None:
    phase, outcome = steps(a_setup(), moved(TRUE, np.random.default_rng(1), 0.02, 0.05), [SCENE])[0]
    weights = tracked((phase, outcome)).cloud.weights
    assert weights.sum() == pytest.approx(1.0)
    assert outcome.effective == pytest.approx(1.0 / np.sum(weights**2))
    assert 1.0 <= outcome.effective <= len(weights)
    assert 0.0 < outcome.likelihood <= 1.0
