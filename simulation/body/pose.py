"""Pose of the simulated person: planted feet, pelvis, spine, head and limbs.

RIGHT and LEFT index the sides; every angle is positive in the direction of its name, on both sides.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person

RIGHT, LEFT = 0, 1
SIDES = (RIGHT, LEFT)
OUTWARD = (-1.0, 1.0)  # sign of the direction away from the body along the person's X axis (to the left), by side


class Pelvis:
    """Indices of `PersonPose.pelvis`."""

    X, Z, DROP, YAW, TILT, ROLL = range(6)


class Arm:
    """Columns of `PersonPose.arms`."""

    ABDUCTION, FLEXION, ROTATION, ELBOW = range(4)


class Foot:
    """Columns of `PersonPose.feet`."""

    X, Z, YAW, LIFT, HEEL = range(5)


class Swing:
    """Columns of `PersonPose.swing`."""

    HIP, APART, KNEE = range(3)


@dataclass(frozen=True)
class PersonPose:
    """Angles in radians, distances in metres; x and z on the ground, yaw from +Z towards +X.

    pelvis: (6,) x, z, drop below standing height, yaw, tilt to the front, roll to the person's right.
    spine: (3,) flexion, bend to the person's right, twist to the left, between pelvis and chest.
    head: (2,) nod to the front, turn to the left.
    arms: (2, 4) abduction, flexion, outward rotation, elbow flexion.
    feet: (2, 5) x, z, yaw of the planted foot, height the ankle is lifted, rise of the heel about the ball.
    swing: (2, 3) hip flexion, hip abduction, knee flexion beyond those that plant the foot.
    """

    pelvis: Floats
    spine: Floats
    head: Floats
    arms: Floats
    feet: Floats
    swing: Floats


@dataclass(frozen=True)
class Placement:
    """Position and heading of a standing person: x, z on the ground in metres, yaw in radians from +Z towards +X."""

    x: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True)
class Motion:
    """A motion that starts with the person standing at the origin, facing +Z.

    pose_at: seconds from the start -> pose.  end: placement of the person afterwards.
    """

    duration_s: float
    pose_at: Callable[[float], PersonPose]
    end: Placement = Placement()


def neutral(person: Person) -> PersonPose:
    """Pose standing at the origin, facing +Z, with hanging arms in this person's manner."""
    manner = person.manner
    feet = np.zeros((2, 5))
    for side in SIDES:
        feet[side, Foot.X] = OUTWARD[side] * manner.stance_half
        feet[side, Foot.YAW] = OUTWARD[side] * manner.toe_out
    arm = [manner.arm_hang, 0.5 * manner.slouch, 0.0, manner.elbow_rest]
    return PersonPose(
        pelvis=np.zeros(6),
        spine=np.array([manner.slouch, 0.0, 0.0]),
        head=np.array([-0.5 * manner.slouch, 0.0]),
        arms=np.array([arm, arm]),
        feet=feet,
        swing=np.zeros((2, 3)),
    )


def interpolate(first: PersonPose, second: PersonPose, share: float) -> PersonPose:
    """Interpolate two poses: share 0 gives the first, 1 the second."""

    def mix(a: Floats, b: Floats) -> Floats:
        return a + share * (b - a)

    return PersonPose(
        mix(first.pelvis, second.pelvis),
        mix(first.spine, second.spine),
        mix(first.head, second.head),
        mix(first.arms, second.arms),
        mix(first.feet, second.feet),
        mix(first.swing, second.swing),
    )


def place(pose: PersonPose, placement: Placement) -> PersonPose:
    """The pose moved with the origin to `placement`."""
    pelvis, feet = pose.pelvis.copy(), pose.feet.copy()
    c, s = cos(placement.yaw), sin(placement.yaw)
    for row in (pelvis, *feet):
        x, z = row[0], row[1]
        row[0] = placement.x + c * x + s * z
        row[1] = placement.z - s * x + c * z
    pelvis[Pelvis.YAW] += placement.yaw
    feet[:, Foot.YAW] += placement.yaw
    return replace(pose, pelvis=pelvis, feet=feet)


def compose(start: Placement, step: Placement) -> Placement:
    """Placement after moving by `step`, relative to `start`, from `start`."""
    c, s = cos(start.yaw), sin(start.yaw)
    return Placement(start.x + c * step.x + s * step.z, start.z - s * step.x + c * step.z, start.yaw + step.yaw)


def minimum_jerk(share: float) -> float:
    """Minimum-jerk interpolation from 0 to 1; constant outside [0, 1]."""
    x = min(max(share, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
