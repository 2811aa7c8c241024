"""Walking and running: planted feet, flight phases in running, natural ranges."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support.joint_paths import STEP_S, joint_paths
from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import unit
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import LEFT, RIGHT, SIDES, Motion
from zenocap.simulation.body.skeleton import FOOT, SHANK, THIGH, Bones, pose_bones
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.gait import gait_motion
from zenocap.simulation.motion.gait_styles import continuous_walk, run, running_gait, walking_gait


def bones_of(seed: int, motion: Motion, from_s: float = 0.0, to_s: float | None = None) -> list[Bones]:
    subject = person(seed)
    return [pose_bones(subject, motion.pose_at(float(t))) for t in np.arange(from_s, to_s or motion.duration_s, STEP_S)]


def on_ground(seed: int, frames: list[Bones], side: int) -> Floats:
    """(n,) whether the ball of a foot is low."""
    subject = person(seed)
    ball = np.array([0.0, -subject.lengths.ankle_height, 0.62 * subject.lengths.foot])
    heights = np.array([b.origin[FOOT[side], 1] + b.rotation[FOOT[side], 1] @ ball for b in frames])
    return heights < 0.015


def knee(frames: list[Bones], side: int) -> Floats:
    """(n,) flexion in degrees."""
    cosines = [b.rotation[THIGH[side], :, 1] @ b.rotation[SHANK[side], :, 1] for b in frames]
    return np.degrees(np.arccos(np.clip(cosines, -1, 1)))


@pytest.mark.parametrize(("seed", "speed"), [(0, 2.2), (3, 2.8), (8, 3.5)])
def test_running_has_flight_phases_and_bent_knees(seed: int, speed: float) -> None:
    frames = bones_of(seed, run(person(seed), speed, 1, 6.0), 2.0, 4.0)
    low = np.array([on_ground(seed, frames, side) for side in SIDES])
    assert 0.05 < (~low.any(axis=0)).mean() < 0.5
    assert not low.all(axis=0).any()
    assert 85 < knee(frames, RIGHT).max() < 130
    moved = frames[-1].origin[0, 2] - frames[0].origin[0, 2]
    assert moved == pytest.approx(speed * STEP_S * (len(frames) - 1), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "speed"), [(0, 0.8), (3, 1.3), (8, 1.7)])
def test_a_walker_always_has_a_foot_on_the_ground(seed: int, speed: float) -> None:
    frames = bones_of(seed, continuous_walk(person(seed), speed, 1, 7.0), 2.0, 5.0)
    low = np.array([on_ground(seed, frames, side) for side in SIDES])
    assert low.any(axis=0).all()
    assert 0.05 < low.all(axis=0).mean() < 0.5
    assert 45 < knee(frames, LEFT).max() < 85


@pytest.mark.parametrize("radius", [None, 1.6, -1.6])
def test_a_planted_foot_does_not_slide(radius: float | None) -> None:
    subject = person(3)
    motion = run(subject, 2.0, 1, 6.0, radius)
    poses = [motion.pose_at(float(t)) for t in np.arange(0.0, 6.0, STEP_S)]
    flat = 0
    for before, after in pairwise(poses):
        for side in SIDES:
            if before.feet[side, 3] == after.feet[side, 3] == 0.0:  # neither is lifted
                flat += 1
                assert np.abs(after.feet[side, :3] - before.feet[side, :3]).max() < 1e-9
    assert flat > 150


@pytest.mark.parametrize("radius", [None, 2.0, -2.0])
def test_gait_starts_at_the_origin_and_ends_standing_at_its_end_placement(radius: float | None) -> None:
    subject = person(5)
    for motion in (run(subject, 2.2, 0, 5.0, radius), continuous_walk(subject, 1.2, 0, 5.0, radius)):
        first, last = truth(subject, motion.pose_at(0.0)), truth(subject, motion.pose_at(motion.duration_s))
        assert np.abs(first.joints["Hip"][[0, 2]]).max() < 0.02
        assert last.joints["Hip"][0] == pytest.approx(motion.end.x, abs=0.02)
        assert last.joints["Hip"][2] == pytest.approx(motion.end.z, abs=0.02)
        assert np.cos(last.yaw - motion.end.yaw) > 0.99
        stance = np.linalg.norm(last.joints["RAnkle"] - last.joints["LAnkle"])
        assert stance == pytest.approx(2 * subject.manner.stance_half, abs=0.02)
        assert radius is None or np.sign(motion.end.x) == np.sign(radius)


def test_runner_faces_the_path_and_leans_into_the_curve() -> None:
    subject = person(5)
    motion = run(subject, 2.0, 0, 8.0, 1.6)
    here, there = (joint_paths(subject, motion, 2.5 + late_s, 5.5 + late_s, 0.1) for late_s in (0.0, 0.17))
    along, left = there["Neck"] - here["Neck"], here["LHip"] - here["RHip"]
    assert np.all(np.abs(np.sum(unit(left) * unit(along), axis=1)) < 0.4)
    feet = 0.5 * (here["RAnkle"] + here["LAnkle"])
    assert np.all(np.sum((here["Neck"] - feet) * left, axis=1) > 0)  # the curve is to the left


@pytest.mark.slow
def test_arms_swing_against_the_legs() -> None:
    subject = person(2)
    for motion in (run(subject, 2.5, 3, 6.0), continuous_walk(subject, 1.3, 3, 6.0)):
        paths = joint_paths(subject, motion, 2.0, 4.0)
        foot, hand = ((paths[f"R{name}"] - paths[f"L{name}"])[:, 2] for name in ("Ankle", "Elbow"))
        assert np.corrcoef(foot, hand)[0, 1] < -0.8


def test_speeds_and_durations_out_of_range_are_rejected() -> None:
    with pytest.raises(ValueError, match=r"speed = 5\.0: allowed: 1\.5 to 3\.6 m/s"):
        running_gait(person(0), 5.0, 0)
    with pytest.raises(ValueError, match=r"speed = 0\.1: allowed: 0\.6 to 1\.9 m/s"):
        walking_gait(person(0), 0.1, 0)
    with pytest.raises(ValueError, match=r"duration_s = 2\.0: allowed: 4 or more"):
        gait_motion(person(0), running_gait(person(0), 2.0, 0), 2.0)
