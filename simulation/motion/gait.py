"""Gait model of walking and running: planted feet, body along a path, arms in antiphase to the legs."""

from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import (
    LEFT,
    OUTWARD,
    RIGHT,
    SIDES,
    Arm,
    Foot,
    Motion,
    Pelvis,
    PersonPose,
    Placement,
    minimum_jerk,
    neutral,
)
from zenocap.simulation.body.skeleton import BALL

RAMP_S = 1.3  # duration from standing to full speed, and back
GRAVITY = 9.81
CLEARANCE_M = 0.025  # of the ball of the swinging foot above the ground


@dataclass(frozen=True)
class Gait:
    """Gait parameters at full speed.  Metres, seconds, radians.

    speed: metres per second.  step_s: time between the landings of the two feet.  contact: fraction of a stride (two
    steps) during which a foot is on the ground; below 0.5 there is a flight phase.  ahead: fraction of a contact before
    the body is over the foot.  lift: height of the swinging ankle.  heel: rotation of the foot about the ball at toe-off,
    which begins at the fraction `rolls` of the contact.  back: backward speed of the foot relative to the body just after
    toe-off and before landing, as a fraction of `speed`.
    drop: of the body below standing height.  bounce: vertical amplitude of the body; positive when lowest over the foot.
    hips, chest: rotation about Y towards the leading foot, per leg length; hips also drop on the swinging side.
    lean: forward.  swing: amplitude of the arms about the angle `arms`.  elbow: flexion, which increases by `fold` when
    the arm is in front.  inward: rotation of the forearms.
    """

    speed: float
    step_s: float
    contact: float
    ahead: float
    lift: float
    heel: float
    rolls: float
    back: float
    drop: float
    bounce: float
    hips: float
    chest: float
    lean: float
    swing: float
    arms: float
    elbow: float
    fold: float
    inward: float


@dataclass(frozen=True)
class _Stance:
    """One foot on the ground from land_s to lift_s at place (3,) x, z, yaw."""

    land_s: float
    lift_s: float
    place: Floats


def gait_motion(person: Person, gait: Gait, duration_s: float, radius: float | None = None) -> Motion:
    """Gait that begins standing at the origin and ends standing; straight, or on a circle of `radius` metres.

    radius: positive to the person's left, negative to the right.  Raises ValueError for less than four seconds.
    """
    if not duration_s >= 4.0:
        raise ValueError(f"duration_s = {duration_s}: allowed: 4 or more seconds")
    curve = 0.0 if radius is None else 1.0 / radius
    course = _Course(gait, duration_s, curve)
    stances = [_stances(person, gait, course, side) for side in SIDES]
    standing = neutral(person)

    def pose_at(time_s: float) -> PersonPose:
        return _pose(person, gait, standing, course, stances, time_s)

    end = course.place(duration_s)
    return Motion(duration_s, pose_at, Placement(float(end[0]), float(end[1]), float(end[2])))


@dataclass(frozen=True)
class _Course:
    """Position of the body along its path: the integral of speed times effort (0 to 1)."""

    gait: Gait
    duration_s: float
    curve: float

    def effort(self, time_s: float) -> float:
        return minimum_jerk(time_s / RAMP_S) * minimum_jerk((self.duration_s - time_s) / RAMP_S)

    def place(self, time_s: float) -> Floats:
        """Placement (3,) x, z, yaw at a time."""
        t = min(max(time_s, 0.0), self.duration_s)
        # The integral of `ease` is RAMP / 2 over a whole ramp, and t^4 (2.5 - 3 u + u^2) inside it.
        far = self._ramp(t) + min(max(t - RAMP_S, 0.0), self.duration_s - 2 * RAMP_S)
        far += 0.5 * RAMP_S - self._ramp(min(self.duration_s - t, RAMP_S))
        far *= self.gait.speed
        yaw = self.curve * far
        if abs(self.curve) < 1e-9:
            return np.array([0.0, far, 0.0])
        return np.array([(1.0 - np.cos(yaw)) / self.curve, np.sin(yaw) / self.curve, yaw])

    def _ramp(self, t: float) -> float:
        u = min(t / RAMP_S, 1.0)
        return RAMP_S * u**4 * (2.5 - 3.0 * u + u * u)


def _stances(person: Person, gait: Gait, course: _Course, side: int) -> list[_Stance]:
    """Ground contacts of a foot in the order of time; the first and the last are those of standing."""

    def foothold(body_s: float) -> Floats:
        x, z, yaw = course.place(body_s)
        effort = course.effort(body_s)
        narrow = person.manner.stance_half * (1.0 - 0.75 * effort)
        out = OUTWARD[side] * narrow
        return np.array([x + np.cos(yaw) * out, z - np.sin(yaw) * out, yaw + OUTWARD[side] * person.manner.toe_out])

    stride_s, contact_s = 2.0 * gait.step_s, 2.0 * gait.step_s * gait.contact
    first_s = 0.30 + (gait.step_s if side == LEFT else 0.0)
    stances = [_Stance(-1.0, first_s, foothold(0.0))]
    land_s = first_s + stride_s - contact_s
    while land_s + contact_s < course.duration_s - 0.25:
        # The foot is less far ahead of the body at landing than it is behind it at toe-off.
        stances.append(_Stance(land_s, land_s + contact_s, foothold(land_s + gait.ahead * contact_s)))
        land_s += stride_s
    last_s = min(land_s, course.duration_s - 0.05)
    stances.append(_Stance(last_s, course.duration_s + 1.0, foothold(course.duration_s)))
    return stances


def _foot(person: Person, gait: Gait, course: _Course, stances: list[_Stance], time_s: float) -> tuple[Floats, float]:
    """Row of `PersonPose.feet` of one foot, and its distance ahead of the body, metres."""
    effort = course.effort(time_s)
    before = max((s for s in stances if s.land_s <= time_s), key=lambda s: s.land_s)
    x, z, yaw = course.place(time_s)
    if time_s <= before.lift_s:
        done = (time_s - before.land_s) / (before.lift_s - before.land_s)
        late = (time_s - before.lift_s) / (2.0 * gait.step_s * gait.contact) + 1.0
        heel = 2.0 * gait.heel * effort * minimum_jerk(0.5 * (min(done, late) - gait.rolls) / (1.0 - gait.rolls))
        row = np.array([before.place[0], before.place[1], before.place[2], 0.0, heel])
        return row, _ahead(row, x, z, yaw)
    after = min((s for s in stances if s.land_s > time_s), key=lambda s: s.land_s)
    u = (time_s - before.lift_s) / (after.land_s - before.lift_s)
    left, _ = _foot(person, gait, course, stances, before.lift_s)
    # Relative to the body, the foot swings from behind to ahead, with a short backward motion at both ends.
    start, end = (_seen(course.place(s), place) for s, place in ((before.lift_s, left[:3]), (after.land_s, after.place)))
    back = -gait.back * course.effort(time_s) * gait.speed * (after.land_s - before.lift_s)
    seen = start + (end - start) * (3.0 - 2.0 * u) * u * u
    seen[1] += back * (u * (1.0 - u) ** 2 + u * u * (u - 1.0))
    place = _placed(course.place(time_s), seen)
    top = float(left[Foot.HEEL]) + 0.25 * effort * minimum_jerk(u / 0.35)
    heel = top - (top + 0.22 * effort) * minimum_jerk((u - 0.35) / 0.50) + 0.22 * effort * minimum_jerk((u - 0.85) / 0.15)
    lift = effort * gait.lift * np.sin(np.pi * u**0.80) ** 1.5 + _rise(person, float(left[Foot.HEEL])) * (
        1.0 - minimum_jerk(u / 0.6)
    )
    # `lift` applies to the ankle, not to the sole: the height added by the raised heel is subtracted.
    arc = effort * float(np.sin(np.pi * u))
    row = np.array([*place, _above(lift - _rise(person, heel), CLEARANCE_M * arc, 0.01 * arc), heel])
    return row, _ahead(row, x, z, yaw)


def _above(height: float, least: float, softly: float) -> float:
    """Smooth maximum of two heights; `softly` is the size of the rounding, metres."""
    return 0.5 * (height + least + float(np.hypot(height - least, softly)))


def _rise(person: Person, heel: float) -> float:
    up = max(heel, 0.0)
    return float(BALL * person.lengths.foot * np.sin(up) + person.lengths.ankle_height * (np.cos(up) - 1.0))


def _seen(body: Floats, place: Floats) -> Floats:
    """Convert a placement (3,) x, z, yaw to the axes of the body at `body` (3,): left, ahead, relative yaw."""
    c, s = np.cos(body[2]), np.sin(body[2])
    x, z = place[0] - body[0], place[1] - body[1]
    return np.array([c * x - s * z, s * x + c * z, place[2] - body[2]])


def _placed(body: Floats, seen: Floats) -> Floats:
    c, s = np.cos(body[2]), np.sin(body[2])
    return np.array([body[0] + c * seen[0] + s * seen[1], body[1] - s * seen[0] + c * seen[1], body[2] + seen[2]])


def _ahead(row: Floats, x: float, z: float, yaw: float) -> float:
    return float(np.sin(yaw) * (row[Foot.X] - x) + np.cos(yaw) * (row[Foot.Z] - z))


def _pose(
    person: Person, gait: Gait, standing: PersonPose, course: _Course, stances: list[list[_Stance]], time_s: float
) -> PersonPose:
    effort = course.effort(time_s)
    x, z, yaw = (float(v) for v in course.place(time_s))
    leg = person.lengths.thigh + person.lengths.shank
    rows, ahead = zip(*(_foot(person, gait, course, stances[side], time_s) for side in SIDES), strict=True)
    apart = float(np.clip((ahead[LEFT] - ahead[RIGHT]) / leg, -1.1, 1.1))
    # The body is lowest in the middle of every contact.
    phase = 2.0 * np.pi * (time_s - 0.30 + gait.step_s * gait.contact) / gait.step_s
    curve = float(np.arctan((effort * gait.speed) ** 2 * course.curve / GRAVITY))
    inward = np.sin(curve) * (leg + person.lengths.ankle_height)
    pelvis = standing.pelvis.copy()
    pelvis[[Pelvis.X, Pelvis.Z]] = x + np.cos(yaw) * inward, z - np.sin(yaw) * inward
    pelvis[Pelvis.DROP] = effort * (gait.drop + gait.bounce * np.cos(phase)) + leg * (1.0 - np.cos(curve))
    pelvis[Pelvis.YAW] = yaw - gait.hips * apart
    pelvis[Pelvis.TILT] = 0.5 * effort * gait.lean
    weight = effort * float(np.cos(0.5 * phase))  # 1: over the right foot, -1: over the left one
    pelvis[[Pelvis.X, Pelvis.Z]] += 0.02 * leg * weight * np.array([-np.cos(yaw), np.sin(yaw)])
    pelvis[Pelvis.ROLL] = -curve - gait.hips * 0.7 * weight
    spine = standing.spine + np.array(
        [0.5 * effort * gait.lean, gait.hips * 0.9 * weight, (gait.hips + gait.chest) * apart]
    )
    arms = standing.arms.copy()
    for side in SIDES:
        with_it = -OUTWARD[side] * apart / 0.8  # the right arm swings with the left foot
        arms[side, Arm.FLEXION] += effort * gait.arms + gait.swing * with_it
        arms[side, Arm.ABDUCTION] += effort * (0.06 - 0.10 * max(with_it, 0.0))
        arms[side, Arm.ROTATION] -= effort * gait.inward * (1.0 + 0.5 * with_it)
        arms[side, Arm.ELBOW] += effort * (gait.elbow + gait.fold * with_it - standing.arms[side, Arm.ELBOW])
    head = standing.head + np.array([-0.6 * effort * gait.lean, -0.6 * gait.chest * apart])
    return replace(standing, pelvis=pelvis, spine=spine, arms=arms, feet=np.array(rows), head=head)
