"""One person from nobody to tracked, lost and found, in scenes of the synthetic actor."""

from collections.abc import Iterable

import numpy as np
import pytest
from tracker_ring import FRAME_NS, Mask, initial, ring, seen, setup, someone

from common.actor.pose import ActorPose, Placement, neutral, place
from common.actor.script import motion_script
from common.actor.truth import truth
from services.tracker.phases import Outcome, Setup, TrackState
from services.tracker.tracking import describe, follow, initial_state

CAMERAS = ring(4)
SEED = 3


def run(
    the: Setup, poses: Iterable[ActorPose | None], state: TrackState | None = None, start: int = 0
) -> tuple[TrackState, list[Outcome], list[str]]:
    """Follow the actor through instants from number `start` on."""
    state = initial_state(the) if state is None else state
    outcomes, words = [], []
    for k, pose in enumerate(poses, start):
        masks: dict[str, Mask] = seen(CAMERAS, SEED, pose)
        state, outcome = follow(the, state, k * FRAME_NS, masks)
        outcomes.append(outcome)
        words.append(describe(state))
    return state, outcomes, words


def hip_error(outcome: Outcome, pose: ActorPose) -> float:
    """Metres."""
    assert outcome.pose is not None
    return float(np.linalg.norm(outcome.pose.position - truth(someone(SEED), pose).joints["Hip"]))


@pytest.fixture(scope="module")
def started() -> tuple[TrackState, list[Outcome], list[str]]:
    return run(setup(CAMERAS), [None, *[initial(SEED)] * 5])


def test_it_waits_measures_and_tracks(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    _, _, words = started
    assert words == [
        "waiting for a person",
        "measuring the body (1 of 4)",
        "measuring the body (2 of 4)",
        "measuring the body (3 of 4)",
        "tracking",
        "tracking",
    ]


def test_the_body_is_said_once_it_is_measured(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    _, outcomes, _ = started
    assert [k for k, outcome in enumerate(outcomes) if outcome.body is not None] == [4]
    assert [k for k, outcome in enumerate(outcomes) if outcome.pose is not None] == [4, 5]
    assert hip_error(outcomes[5], initial(SEED)) < 0.06


def test_before_that_it_says_what_it_waits_for() -> None:
    at_ease = neutral(someone(SEED))
    _, outcomes, words = run(setup(CAMERAS), [at_ease])
    assert words[0].startswith("stretch both arms sideways")
    assert outcomes[0].pose is None
    assert not outcomes[0].lost


def test_whoever_moves_between_two_instants_is_measured_from_the_start() -> None:
    _, _, words = run(setup(CAMERAS), [initial(SEED), initial(SEED), initial(SEED, x=0.4)])
    assert words == ["measuring the body (1 of 4)", "measuring the body (2 of 4)", "measuring the body (1 of 4)"]


def test_two_runs_of_one_seed_are_equal(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    walking = motion_script(someone(SEED), "walking", 0)
    poses = [walking.pose_at(walking.motion_from_s + k / 30) for k in range(4)]
    _, one, _ = run(setup(CAMERAS), poses, state, 6)
    _, other, _ = run(setup(CAMERAS), poses, state, 6)
    for a, b in zip(one, other, strict=True):
        assert a.pose is not None
        assert b.pose is not None
        np.testing.assert_array_equal(a.pose.angles, b.pose.angles)
        np.testing.assert_array_equal(a.spread, b.spread)


def test_another_seed_gives_another_cloud(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    _, one, _ = run(setup(CAMERAS), [initial(SEED)], state, 6)
    _, other, _ = run(setup(CAMERAS, seed=1), [initial(SEED)], state, 6)
    assert not np.array_equal(one[0].spread, other[0].spread)


def test_ten_empty_instants_are_waited_out(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    _, outcomes, _ = run(setup(CAMERAS), [*[None] * 10, *[initial(SEED, x=0.05)] * 2], state, 6)
    assert all(outcome.lost and outcome.pose is None for outcome in outcomes[:10])
    assert hip_error(outcomes[-1], initial(SEED, x=0.05)) < 0.06


def test_who_leaves_is_searched_for_and_found_elsewhere(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    state, gone, words = run(setup(CAMERAS), [None] * 61, state, 6)
    assert words[-1] == "searching for the person"
    assert gone[-1].lost
    back = place(neutral(someone(SEED)), Placement(-0.5, 0.4, 0.6))
    _, outcomes, words = run(setup(CAMERAS), [back] * 2, state, 67)
    assert words[-1] == "tracking"
    assert hip_error(outcomes[-1], back) < 0.08
    assert outcomes[0].body is None  # it is the same person


def test_who_is_suddenly_elsewhere_is_found_there(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    there = place(neutral(someone(SEED)), Placement(0.9, -0.6, -0.4))
    _, outcomes, words = run(setup(CAMERAS), [there] * 4, state, 6)
    assert words[-1] == "tracking"
    assert hip_error(outcomes[-1], there) < 0.08


def test_a_known_height_needs_no_initial_posture() -> None:
    here = place(neutral(someone(SEED)), Placement(0.3, 0.2, 0.5))
    _, outcomes, words = run(setup(CAMERAS, person_height=someone(SEED).height), [here] * 3)
    assert words[0] == "tracking"
    assert outcomes[0].body is not None
    assert hip_error(outcomes[-1], here) < 0.08


def test_a_viewer_that_is_not_there_is_not_used(started: tuple[TrackState, list[Outcome], list[str]]) -> None:
    state, _, _ = started
    masks = seen(CAMERAS, SEED, initial(SEED))
    _, outcome = follow(setup(CAMERAS), state, 6 * FRAME_NS, {viewer: masks[viewer] for viewer in ("1", "2", "4")})
    assert outcome.views == ("1", "2", "4")
    assert hip_error(outcome, initial(SEED)) < 0.06
