"""Everyday activities with variation by seed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import (
    OUTWARD,
    SIDES,
    Arm,
    Foot,
    Motion,
    Pelvis,
    PersonPose,
    interpolate,
    minimum_jerk,
    neutral,
)
from zenocap.simulation.motion.arm_ik import ArmGoal, reach_goal

ACTIVITIES = ("bend", "lean", "twist", "reach", "sit", "lunge", "gesture")
Course = Callable[[float], PersonPose]


def activity(person: Person, name: str, seed: int) -> Motion:
    """One movement that begins and ends standing at the origin.  Raises ValueError for a name not in ACTIVITIES.

    seed: 0 or more, variation of this repetition.
    """
    if name not in ACTIVITIES:
        raise ValueError(f"movement {name!r} is not one of {', '.join(ACTIVITIES)}")
    rng = np.random.default_rng([0x34, person.seed, ACTIVITIES.index(name), seed])
    duration_s = float(rng.uniform(2.2, 3.6)) / person.manner.tempo
    if name == "gesture":
        duration_s *= 1.8
    return Motion(duration_s, _COURSES[name](person, rng, duration_s))


def _pulse(u: float, rise: float, fall: float) -> float:
    """Pulse over u in [0, 1]: 0 at both ends, 1 between `rise` and `fall`."""
    return minimum_jerk(u / rise) * (1.0 - minimum_jerk((u - fall) / (1.0 - fall)))


def _bend(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Bend to the floor in front of the feet, knees bent or straight, with one hand or both."""
    standing, leg = neutral(person), person.lengths.thigh + person.lengths.shank
    deep, knees = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.03, 0.28))
    hands = SIDES if rng.uniform() < 0.6 else (int(rng.integers(2)),)
    aside = float(rng.normal(0.0, 0.25))

    def pose_at(time_s: float) -> PersonPose:
        down = _pulse(time_s / duration_s, 0.42, 0.55)
        pelvis = standing.pelvis.copy()
        pelvis[Pelvis.DROP] += down * knees * deep * leg
        pelvis[Pelvis.Z] -= down * 0.12 * deep * leg
        pelvis[Pelvis.TILT] += down * 0.80 * deep
        spine = standing.spine + down * deep * np.array([0.85, 0.15 * aside, aside])
        head = standing.head + np.array([-0.25 * down * deep, 0.0])
        arms = standing.arms.copy()
        for side in hands:
            arms[side] += down * np.array([-0.15, 1.35 * deep, 0.0, 0.05])
        return replace(standing, pelvis=pelvis, spine=spine, head=head, arms=arms)

    return pose_at


def _lean(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Lean to one side and the other."""
    standing = neutral(person)
    first, second = rng.uniform(0.15, 0.50, 2) * float(rng.choice([-1.0, 1.0])) * np.array([1.0, -1.0])
    up = float(rng.uniform(0.0, 2.4))

    def pose_at(time_s: float) -> PersonPose:
        u = time_s / duration_s
        bend = first * _pulse(min(2.0 * u, 1.0), 0.5, 0.6) + second * _pulse(max(2.0 * u - 1.0, 0.0), 0.4, 0.5)
        arms, pelvis = standing.arms.copy(), standing.pelvis.copy()
        for side in SIDES:
            arms[side, Arm.ABDUCTION] += up * max(-OUTWARD[side] * -bend, 0.0)
        pelvis[Pelvis.X] += 0.08 * bend
        return replace(standing, spine=standing.spine + np.array([0.0, bend, 0.0]), arms=arms, pelvis=pelvis)

    return pose_at


def _twist(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Twist to look behind; the arms follow."""
    standing = neutral(person)
    far = float(rng.uniform(0.35, 0.8) * rng.choice([-1.0, 1.0]))
    spread = float(rng.uniform(0.0, 1.0))

    def pose_at(time_s: float) -> PersonPose:
        u = time_s / duration_s
        turn = far * (_pulse(min(2.0 * u, 1.0), 0.5, 0.5) - _pulse(max(2.0 * u - 1.0, 0.0), 0.5, 0.5))
        arms, pelvis = standing.arms.copy(), standing.pelvis.copy()
        pelvis[Pelvis.YAW] += 0.35 * turn
        arms[:, Arm.ABDUCTION] += spread * _pulse(u, 0.3, 0.7)
        head = standing.head + np.array([0.0, 0.5 * turn])
        return replace(standing, pelvis=pelvis, spine=standing.spine + np.array([0.0, 0.0, turn]), arms=arms, head=head)

    return pose_at


def _goal(person: Person, rng: np.random.Generator, side: int, near: bool = False) -> ArmGoal:
    """Random goal in front of, beside or above the shoulder, or near the body, with the elbow down and outwards."""
    arm, out = person.lengths.upper_arm + person.lengths.forearm, OUTWARD[side]
    shoulder = np.array([out * person.lengths.shoulder_half, 0.0, 0.0])
    if near:  # at hips, chest, chin, head
        places = ((0.15, -0.42, 0.12), (-0.05, -0.15, 0.20), (-0.10, 0.08, 0.16), (0.02, 0.28, 0.05))
        x, y, z = places[int(rng.integers(len(places)))]
        wrist = np.array([out * x, y, z]) * (arm / 0.55) + rng.normal(0.0, 0.03, 3)
        return ArmGoal(wrist + shoulder * 0.6, np.array([out, -0.6, -0.3]))
    azimuth = float(rng.uniform(-0.4, 1.5))  # from the front outwards
    height = float(rng.uniform(-0.8, 1.1))
    way = np.array([out * np.sin(azimuth) * np.cos(height), np.sin(height), np.cos(azimuth) * np.cos(height)])
    wrist = shoulder + float(rng.uniform(0.6, 0.97)) * arm * way
    return ArmGoal(wrist, np.array([out * 0.7, -1.0 + 0.5 * max(height, 0.0), -0.3]))


def _reach(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Reach for a point with one hand or both, with some motion of the body."""
    standing = neutral(person)
    sides = SIDES if rng.uniform() < 0.35 else (int(rng.integers(2)),)
    goals = {side: _goal(person, rng, side) for side in sides}
    help_ = float(rng.uniform(0.0, 1.0))

    def pose_at(time_s: float) -> PersonPose:
        out = _pulse(time_s / duration_s, 0.38, 0.58)
        turn = -sum(OUTWARD[side] for side in sides) * 0.30 * help_ * out
        spine = standing.spine + np.array([0.15 * help_ * out, 0.0, turn])
        body = replace(standing, spine=spine, head=standing.head + np.array([0.0, -0.6 * turn]))
        there = body
        for side, goal in goals.items():
            there = reach_goal(person, there, side, goal)
        return interpolate(body, there, out)

    return pose_at


def _gesture(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Gesture: both hands move between points, as in talking, pointing, or touching hips and head."""
    standing = neutral(person)
    count = 5
    ways = [[_goal(person, rng, side, bool(rng.uniform() < 0.5)) for _ in range(count)] for side in SIDES]
    turns = np.concatenate([[0.0], rng.normal(0.0, 0.12, count), [0.0]])

    def pose_at(time_s: float) -> PersonPose:
        at = min(max(time_s / duration_s, 0.0), 1.0) * (count + 1)
        k = min(int(at), count)
        share = minimum_jerk((at - k) / 0.8)
        turn = float(turns[k] + share * (turns[k + 1] - turns[k]))
        body = replace(standing, spine=standing.spine + np.array([0.0, 0.3 * turn, turn]))
        poses = []
        for point in (k - 1, k):
            pose = body
            if 0 <= point < count:
                for side in SIDES:
                    pose = reach_goal(person, pose, side, ways[side][point])
            poses.append(pose)
        return interpolate(poses[0], poses[1], share)

    return pose_at


def _sit(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Sit down as if on a chair, pause, and stand up."""
    standing, leg = neutral(person), person.lengths.thigh + person.lengths.shank
    deep = float(rng.uniform(0.36, 0.50))
    lap = float(rng.uniform(0.3, 0.9))
    still = float(rng.uniform(0.5, 0.65))

    def pose_at(time_s: float) -> PersonPose:
        u = time_s / duration_s
        down, leaning = _pulse(u, 0.40, still), _pulse(u, 0.25, 0.8) - 0.75 * _pulse(u, 0.5, 0.55)
        pelvis, feet, arms = standing.pelvis.copy(), standing.feet.copy(), standing.arms.copy()
        pelvis[Pelvis.DROP] += down * deep * leg
        pelvis[Pelvis.Z] -= down * 0.36 * leg
        pelvis[Pelvis.TILT] += 0.55 * leaning + 0.05 * down
        for side in SIDES:
            arms[side, Arm.FLEXION] += lap * down + 0.4 * leaning
            arms[side, Arm.ELBOW] += 0.9 * lap * down
        spine = standing.spine + np.array([0.30 * leaning + 0.08 * down, 0.0, 0.0])
        return replace(standing, pelvis=pelvis, spine=spine, arms=arms, feet=feet)

    return pose_at


def _lunge(person: Person, rng: np.random.Generator, duration_s: float) -> Course:
    """Long step forwards or sideways, and back."""
    standing, leg = neutral(person), person.lengths.thigh + person.lengths.shank
    side, wide = int(rng.integers(2)), float(rng.uniform(0.45, 0.80)) * leg
    azimuth = float(rng.uniform(-0.2, 1.3))
    step = wide * np.array([OUTWARD[side] * np.sin(azimuth), np.cos(azimuth)])
    raised = float(rng.uniform(0.0, 1.2))

    def pose_at(time_s: float) -> PersonPose:
        u = time_s / duration_s
        foot = minimum_jerk(u / 0.35) * (1.0 - minimum_jerk((u - 0.65) / 0.35))
        weight = _pulse(u, 0.45, 0.58)
        pelvis, feet, arms = standing.pelvis.copy(), standing.feet.copy(), standing.arms.copy()
        feet[side, [Foot.X, Foot.Z]] += foot * step
        feet[side, Foot.LIFT] += 0.09 * np.sin(np.pi * foot) ** 2
        feet[1 - side, Foot.HEEL] += 0.6 * weight * max(np.cos(azimuth), 0.0)
        pelvis[[Pelvis.X, Pelvis.Z]] += 0.55 * step * weight
        pelvis[Pelvis.DROP] += 0.16 * leg * weight
        pelvis[Pelvis.TILT] += 0.08 * weight
        arms[:, Arm.ABDUCTION] += raised * weight
        return replace(standing, pelvis=pelvis, feet=feet, arms=arms)

    return pose_at


_COURSES: dict[str, Callable[[Person, np.random.Generator, float], Course]] = {
    "bend": _bend,
    "lean": _lean,
    "twist": _twist,
    "reach": _reach,
    "sit": _sit,
    "lunge": _lunge,
    "gesture": _gesture,
}
