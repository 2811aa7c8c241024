"""Everyday movements and performances: start and end standing, no jumps, seeds differ."""

import numpy as np
import pytest

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import Motion
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.activities import ACTIVITIES, activity
from zenocap.simulation.motion.motion_corpus import KINDS, chained, corpus_motion

FASTEST_M_S = 11.0


def points_of(seed: int, motion: Motion, step_s: float = 0.02) -> Floats:
    frames = [landmarks(person(seed), motion.pose_at(float(t))) for t in np.arange(0.0, motion.duration_s, step_s)]
    return np.array([list(frame.values()) for frame in frames])


@pytest.mark.nightly
@pytest.mark.parametrize("name", ACTIVITIES)
def test_a_movement_begins_and_ends_standing_and_does_not_jump(name: str) -> None:
    points = points_of(5, activity(person(5), name, 2))
    np.testing.assert_allclose(points[0], points[-1], atol=0.01)
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() / 0.02 < FASTEST_M_S
    assert np.ptp(points, axis=0).max() > 0.05
    assert points[:, :, 1].min() > -0.02


@pytest.mark.parametrize("name", ACTIVITIES)
def test_equal_seeds_give_equal_movements_and_other_seeds_others(name: str) -> None:
    subject = person(5)
    one, again, other = (activity(subject, name, seed).pose_at(1.3) for seed in (1, 1, 2))
    for field in ("pelvis", "spine", "arms", "feet"):
        np.testing.assert_array_equal(getattr(one, field), getattr(again, field))
    assert any(not np.allclose(getattr(one, field), getattr(other, field)) for field in ("pelvis", "spine", "arms", "feet"))


def test_people_sit_down_and_bend_to_the_floor() -> None:
    subject = person(8)
    standing = landmarks(subject, activity(subject, "sit", 1).pose_at(0.0))
    sitting = activity(subject, "sit", 1)
    lowest = min(landmarks(subject, sitting.pose_at(t))["Hip"][1] for t in np.linspace(0, sitting.duration_s, 40))
    assert lowest < 0.72 * standing["Hip"][1]
    hands = []
    for seed in range(8):
        bending = activity(subject, "bend", seed)
        hands += [landmarks(subject, bending.pose_at(t))["RWrist"][1] for t in np.linspace(0, bending.duration_s, 25)]
    assert min(hands) < 0.5


@pytest.mark.nightly
def test_chained_motions_continue_at_the_end_position() -> None:
    subject = person(1)
    walks = corpus_motion(subject, "walking", 3)
    pair = chained(subject, [walks, walks])
    points = points_of(1, pair, 0.04)
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() / 0.04 < FASTEST_M_S
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
