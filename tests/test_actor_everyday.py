"""Everyday movements and long performances: from standing to standing, without jumps, each seed another."""

import numpy as np
import pytest

from common.actor.everyday import EVERYDAY, everyday
from common.actor.person import person
from common.actor.pose import Motion
from common.actor.repertoire import KINDS, chained, performance
from common.actor.rotation import Floats
from common.actor.truth import landmarks

FASTEST_M_S = 11.0


def points_of(seed: int, motion: Motion, step_s: float = 0.02) -> Floats:
    frames = [landmarks(person(seed), motion.pose_at(float(t))) for t in np.arange(0.0, motion.duration_s, step_s)]
    return np.array([list(frame.values()) for frame in frames])


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_movement_begins_and_ends_standing_and_does_not_jump(name: str) -> None:
    points = points_of(5, everyday(person(5), name, 2))
    np.testing.assert_allclose(points[0], points[-1], atol=0.01)
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() / 0.02 < FASTEST_M_S
    assert np.ptp(points, axis=0).max() > 0.05
    assert points[:, :, 1].min() > -0.02


@pytest.mark.parametrize("name", EVERYDAY)
def test_each_seed_is_another_and_the_same_seed_the_same(name: str) -> None:
    someone = person(5)
    one, again, other = (everyday(someone, name, seed).pose_at(1.3) for seed in (1, 1, 2))
    for field in ("pelvis", "spine", "arms", "feet"):
        np.testing.assert_array_equal(getattr(one, field), getattr(again, field))
    assert any(not np.allclose(getattr(one, field), getattr(other, field)) for field in ("pelvis", "spine", "arms", "feet"))


def test_people_sit_down_and_bend_to_the_floor() -> None:
    someone = person(8)
    standing = landmarks(someone, everyday(someone, "sit", 1).pose_at(0.0))
    sitting = everyday(someone, "sit", 1)
    lowest = min(landmarks(someone, sitting.pose_at(t))["Hip"][1] for t in np.linspace(0, sitting.duration_s, 40))
    assert lowest < 0.72 * standing["Hip"][1]
    hands = []
    for seed in range(8):
        bending = everyday(someone, "bend", seed)
        hands += [landmarks(someone, bending.pose_at(t))["RWrist"][1] for t in np.linspace(0, bending.duration_s, 25)]
    assert min(hands) < 0.5


def test_a_chain_goes_on_from_where_it_was() -> None:
    someone = person(1)
    walks = performance(someone, "walking", 3)
    pair = chained(someone, [walks, walks])
    points = points_of(1, pair, 0.04)
    assert np.linalg.norm(np.diff(points, axis=0), axis=2).max() / 0.04 < FASTEST_M_S
    last = landmarks(someone, pair.pose_at(pair.duration_s))["Hip"]
    assert (last[0], last[2]) == (pytest.approx(pair.end.x, abs=0.03), pytest.approx(pair.end.z, abs=0.03))


@pytest.mark.parametrize("kind", KINDS)
def test_a_performance_is_long_and_its_seeds_differ(kind: str) -> None:
    someone = person(2)
    one, other = performance(someone, kind, 0), performance(someone, kind, 1)
    assert one.duration_s > 20.0
    courses = [[motion.pose_at(t).spine for t in np.arange(2.0, 12.0, 0.5)] for motion in (one, other)]
    assert not np.allclose(*courses)


def test_unknown_movements_are_refused() -> None:
    with pytest.raises(ValueError, match="'fly' is not one of bend, lean"):
        everyday(person(0), "fly", 0)
    with pytest.raises(ValueError, match="'fly' is not one of walking, running"):
        performance(person(0), "fly", 0)
