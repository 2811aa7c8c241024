"""Walking and turning by footsteps: one foot is planted while the other swings."""

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

DOUBLE_SUPPORT = 0.22  # share of a step with both feet on the ground


@dataclass(frozen=True)
class Footstep:
    """Swing of one foot between two positions (3,) x, z, yaw, metres and radians; times in seconds."""

    side: int
    lift_s: float
    land_s: float
    start: Floats
    end: Floats


def walk(person: Person, path: list[Placement], step_s: float, first: int = RIGHT, arms: float = 1.0) -> Motion:
    """Walk through the placements of `path`, one step each, from standing at the origin to standing at the last one.

    step_s: duration of a step, seconds.  first: side of the first step.  arms: factor on the arm swing.
    """
    steps = _footsteps(person, path, step_s, first)
    times, track = _body_track(path, step_s)
    standing = neutral(person)

    def pose_at(time_s: float) -> PersonPose:
        return _pose(person, standing, steps, _hermite(times, track, time_s), time_s, step_s, arms)

    return Motion(float(times[-1]), pose_at, path[-1])


def turning_path(angle: float, steps: int) -> list[Placement]:
    """Path of a turn on the spot by `angle` radians."""
    return [Placement(0.0, 0.0, angle * k / steps) for k in range(1, steps + 1)]


def circle_path(radius: float, steps: int) -> list[Placement]:
    """Path of a full circle to the person's right; radius in metres.  It ends at its start."""
    angles = -2.0 * np.pi * np.arange(1, steps + 1) / steps
    return [Placement(float(radius * (np.cos(a) - 1.0)), float(-radius * np.sin(a)), float(a)) for a in angles]


def return_path(end: Placement, stride: float) -> list[Placement]:
    """Path back to the origin and its heading, relative to a person at `end`; stride in metres."""
    c, s = np.cos(end.yaw), np.sin(end.yaw)
    x, z = float(-c * end.x + s * end.z), float(-s * end.x - c * end.z)
    far, heading = float(np.hypot(x, z)), float(np.arctan2(x, z))
    count = max(round(far / stride), 1)
    turns = max(round(abs(heading) / 0.8), 1)
    path = [Placement(0.0, 0.0, heading * k / turns) for k in range(1, turns + 1)]
    path += [Placement(x * k / count, z * k / count, heading) for k in range(1, count + 1)]
    left = float((-end.yaw - heading + np.pi) % (2.0 * np.pi) - np.pi)
    turns = max(round(abs(left) / 0.8), 1)
    return path + [Placement(x, z, heading + left * k / turns) for k in range(1, turns + 1)]


def _footsteps(person: Person, path: list[Placement], step_s: float, first: int) -> list[Footstep]:
    manner = person.manner

    def foothold(at: Placement, side: int, narrow: float) -> Floats:
        out = OUTWARD[side] * manner.stance_half * narrow
        c, s = np.cos(at.yaw), np.sin(at.yaw)
        return np.array([at.x + c * out, at.z - s * out, at.yaw + OUTWARD[side] * manner.toe_out])

    at = [foothold(Placement(), side, 1.0) for side in SIDES]
    steps = []
    closing = [*path, path[-1]]  # the last step brings the feet together
    for k, place in enumerate(closing):
        side = first if k % 2 == 0 else 1 - first
        turning = abs(place.yaw - (closing[k - 1].yaw if k else 0.0)) > 0.35
        narrow = 1.0 if k >= len(closing) - 2 or turning else 0.75
        end = foothold(place, side, narrow)
        lift_s, land_s = (k + DOUBLE_SUPPORT) * step_s, (k + 1.0) * step_s
        steps.append(Footstep(side, lift_s, land_s, at[side], end))
        at[side] = end
    return steps


def _body_track(path: list[Placement], step_s: float) -> tuple[Floats, Floats]:
    """Times (n,) and placements (n, 3) x, z, yaw of the body: midway between both feet at each landing."""
    places = np.array([[0.0, 0.0, 0.0], *([p.x, p.z, p.yaw] for p in path), [path[-1].x, path[-1].z, path[-1].yaw]])
    middle = 0.5 * (places[1:] + places[:-1])
    return step_s * np.arange(len(places), dtype=np.float64), np.vstack([places[:1], middle])


def _hermite(times: Floats, values: Floats, time_s: float) -> Floats:
    """Smooth interpolation of (n, k) values at evenly spaced times, constant before the first and after the last."""
    slopes = np.zeros_like(values)
    slopes[1:-1] = 0.5 * (values[2:] - values[:-2])
    step = float(times[1] - times[0])
    u = min(max(time_s / step, 0.0), len(times) - 1.0)
    k = min(int(u), len(times) - 2)
    f = u - k
    course: Floats = (
        (1.0 + 2.0 * f) * (1.0 - f) ** 2 * values[k]
        + f * (1.0 - f) ** 2 * slopes[k]
        + f * f * (3.0 - 2.0 * f) * values[k + 1]
        + f * f * (f - 1.0) * slopes[k + 1]
    )
    return course


def _foot(person: Person, standing: Floats, steps: list[Footstep], side: int, time_s: float, step_s: float) -> Floats:
    """Row of `PersonPose.feet` of one foot at a time."""
    foot = standing.copy()
    for step in steps:
        if step.side != side:
            continue
        stride = float(np.hypot(*(step.end[:2] - step.start[:2])))
        flight = (time_s - step.lift_s) / (step.land_s - step.lift_s)
        along = minimum_jerk(flight)
        if flight >= 0.0:
            foot[[Foot.X, Foot.Z, Foot.YAW]] = step.start + along * (step.end - step.start)
        # The heel rises before the foot leaves the ground, in proportion to the stride.
        rise = min(stride / person.lengths.thigh, 1.3) * 0.55
        before_s = min(0.45 * step_s, step.lift_s)
        early = minimum_jerk((time_s - step.lift_s + before_s) / before_s)
        late = minimum_jerk(flight / 0.75)
        foot[Foot.HEEL] += rise * early * (1.0 - late)
        if 0.0 < flight < 1.0:
            foot[Foot.LIFT] += (0.035 + 0.06 * min(stride, 0.6)) * np.sin(np.pi * flight) ** 2
            foot[Foot.HEEL] -= 0.22 * min(stride / 0.5, 1.0) * np.sin(np.pi * flight**3) ** 2
    return foot


def _pose(
    person: Person, standing: PersonPose, steps: list[Footstep], body: Floats, time_s: float, step_s: float, arms: float
) -> PersonPose:
    feet = np.array([_foot(person, standing.feet[side], steps, side, time_s, step_s) for side in SIDES])
    heading = np.array([np.sin(body[2]), np.cos(body[2])])
    left = np.array([np.cos(body[2]), -np.sin(body[2])])
    # The weight shifts over the planted foot.
    higher = float(feet[RIGHT, Foot.LIFT] - feet[LEFT, Foot.LIFT])
    shift = 0.25 * person.manner.stance_half * float(np.clip(higher / 0.05, -1.0, 1.0))
    pelvis = standing.pelvis.copy()
    pelvis[[Pelvis.X, Pelvis.Z]] = body[:2] + shift * left
    ahead = float((feet[LEFT, [Foot.X, Foot.Z]] - feet[RIGHT, [Foot.X, Foot.Z]]) @ heading) / person.lengths.thigh
    pelvis[Pelvis.YAW] = body[2] - 0.10 * ahead
    pelvis[Pelvis.ROLL] = 0.5 * shift
    pelvis[Pelvis.DROP] = 0.012 * min(abs(ahead), 1.0)
    spine = standing.spine + np.array([0.03 * min(abs(ahead), 1.0), 0.0, 0.22 * ahead])
    row = standing.arms.copy()
    swing = 0.42 * arms * person.manner.vigour * ahead
    row[RIGHT, Arm.FLEXION] += swing
    row[LEFT, Arm.FLEXION] -= swing
    row[:, Arm.ELBOW] += 0.30 * arms * np.clip(row[:, Arm.FLEXION], 0.0, None) + 0.06 * min(abs(ahead), 1.0)
    head = standing.head + np.array([0.0, -0.10 * ahead])
    return replace(standing, pelvis=pelvis, spine=spine, arms=row, feet=feet, head=head)
