"""Everyday movements and performances: start and end standing, no jumps, seeds differ."""

import numpy as np
import pytest

from tests.support.joint_paths import joint_paths, top_speed
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.activities import ACTIVITIES, activity
from zenocap.simulation.motion.motion_corpus import KINDS, chained, corpus_motion

FASTEST_M_S = 11.0


@pytest.mark.nightly
@pytest.mark.parametrize("name", ACTIVITIES)
def test_a_movement_begins_and_ends_standing_and_does_not_jump(name: str) -> None:
    paths = joint_paths(person(5), activity(person(5), name, 2))
    points = np.array(list(paths.values()))
    np.testing.assert_allclose(points[:, 0], points[:, -1], atol=0.01)
    assert top_speed(paths) < FASTEST_M_S
    assert np.ptp(points, axis=1).max() > 0.05
    assert points[:, :, 1].min() > -0.02


@pytest.mark.parametrize("name", ACTIVITIES)
def test_equal_seeds_give_equal_movements_and_other_seeds_others(name: str) -> None:
    subject = person(5)
    poses = [activity(subject, name, seed).pose_at(1.3) for seed in (1, 1, 2)]
    one, again, other = (np.concatenate([pose.pelvis, pose.spine, pose.arms.ravel(), pose.feet.ravel()]) for pose in poses)
    np.testing.assert_array_equal(one, again)
    assert not np.allclose(one, other)


def test_people_sit_down_and_bend_to_the_floor() -> None:
    subject = person(8)
    hip = joint_paths(subject, activity(subject, "sit", 1), step_s=0.1)["Hip"][:, 1]
    assert hip.min() < 0.72 * hip[0]
    hands = [joint_paths(subject, activity(subject, "bend", seed), step_s=0.1)["RWrist"] for seed in range(8)]
    assert np.concatenate(hands)[:, 1].min() < 0.5


@pytest.mark.nightly
def test_chained_motions_continue_at_the_end_position() -> None:
    subject = person(1)
    walks = corpus_motion(subject, "walking", 3)
    pair = chained(subject, [walks, walks])
    assert top_speed(joint_paths(subject, pair, step_s=0.04), 0.04) < FASTEST_M_S
    last = landmarks(subject, pair.pose_at(pair.duration_s))["Hip"]
    assert (last[0], last[2]) == (pytest.approx(pair.end.x, abs=0.03), pytest.approx(pair.end.z, abs=0.03))


@pytest.mark.parametrize("kind", KINDS)
def test_corpus_motion_is_long_and_depends_on_the_seed(kind: str) -> None:
    subject = person(2)
    one, other = corpus_motion(subject, kind, 0), corpus_motion(subject, kind, 1)
    assert one.duration_s > 20.0
    spine_curves = [[motion.pose_at(t).spine for t in np.arange(2.0, 12.0, 0.5)] for motion in (one, other)]
    assert not np.allclose(*spine_curves)


def test_unknown_movements_are_refused() -> None:
    with pytest.raises(ValueError, match="'fly' is not one of bend, lean"):
        activity(person(0), "fly", 0)
    with pytest.raises(ValueError, match="'fly' is not one of walking, running"):
        corpus_motion(person(0), "fly", 0)
