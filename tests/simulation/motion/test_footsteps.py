"""Footsteps: planted feet do not slide, and the body stops at the end of the path."""

import numpy as np
import pytest

from tests.support.joint_paths import STEP_S, joint_paths
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import Placement, compose
from zenocap.simulation.body.skeleton import pose_bones
from zenocap.simulation.motion.footsteps import circle_path, return_path, turning_path, walk

STRAIGHT = [Placement(0.0, 0.45 * k) for k in range(1, 7)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 9, 22])
def test_low_ankle_does_not_slide(seed: int) -> None:
    subject = person(seed)
    paths = joint_paths(subject, walk(subject, circle_path(0.75, 10), 0.55))
    low = subject.lengths.ankle_height + 0.004
    for ankle in (paths["RAnkle"], paths["LAnkle"]):
        still = (ankle[1:, 1] < low) & (ankle[:-1, 1] < low)
        assert still.mean() > 0.3
        assert np.linalg.norm(np.diff(ankle, axis=0)[still], axis=1).max() < 0.012


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 9, 22])
def test_walking_goes_forward_at_a_human_speed(seed: int) -> None:
    subject = person(seed)
    hip = joint_paths(subject, walk(subject, STRAIGHT, 0.55))["Hip"]
    speed = np.diff(hip[:, 2]) / STEP_S
    assert speed.min() > -0.05
    assert 0.6 < np.median(speed) < 1.1
    assert np.ptp(hip[:, 1]) < 0.08


def test_arms_swing_against_the_legs() -> None:
    subject = person(3)
    motion = walk(subject, STRAIGHT, 0.55)
    paths = joint_paths(subject, motion, 0.5, motion.duration_s - 0.5, 0.05)
    foot, hand = ((paths[f"R{name}"] - paths[f"L{name}"])[:, 2] for name in ("Ankle", "Wrist"))
    assert np.corrcoef(foot, hand)[0, 1] < -0.8


def test_turning_stays_on_the_spot() -> None:
    subject = person(3)
    motion = walk(subject, turning_path(2.0 * np.pi, 8), 0.5)
    assert np.abs(joint_paths(subject, motion, step_s=0.05)["Hip"][:, [0, 2]]).max() < 0.08
    assert motion.end.yaw == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize("end", [Placement(1.1, 0.1, 1.5), Placement(-0.5, 0.8, -2.0), Placement(0.4, -1.0, 3.0)])
def test_return_path_ends_at_the_origin(end: Placement) -> None:
    back = compose(end, return_path(end, 0.45)[-1])
    assert abs(back.x) < 1e-9
    assert abs(back.z) < 1e-9
    assert np.cos(back.yaw) == pytest.approx(1.0)


def test_a_circle_ends_where_it_starts() -> None:
    end = circle_path(0.8, 11)[-1]
    assert (end.x, end.z) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.0, abs=1e-12))


def test_feet_stay_on_or_above_the_ground() -> None:
    subject = person(6)
    motion = walk(subject, circle_path(0.75, 10), 0.55)
    for t in np.arange(0.0, motion.duration_s, 0.05):
        assert pose_bones(subject, motion.pose_at(t)).origin[:, 1].min() > subject.lengths.ankle_height - 0.003
