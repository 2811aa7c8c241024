"""Boxing: a moving guard, and jabs, crosses, hooks, uppercuts, slips and shuffles in random order."""

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import (
    LEFT,
    OUTWARD,
    SIDES,
    Foot,
    Motion,
    Pelvis,
    PersonPose,
    interpolate,
    minimum_jerk,
    neutral,
)
from zenocap.simulation.body.rotation import ry
from zenocap.simulation.body.skeleton import HEAD, pose_bones
from zenocap.simulation.motion.arm_ik import ArmGoal, in_chest, reach_goal
from zenocap.simulation.motion.boxing_moves import ENTER_S, PUNCHES, BoxingStyle, Move, boxing_moves, boxing_style

# Rotation of hips and chest together, radians, positive when the lead side moves backward.
TURNS = {"jab": -0.26, "lead-hook": -0.60, "lead-uppercut": -0.45, "cross": 0.62, "rear-hook": 0.65, "rear-uppercut": 0.50}


def box(person: Person, duration_s: float, seed: int) -> Motion:
    """Shadow boxing towards +Z for duration_s seconds, beginning and ending with standing.

    seed: 0 or more, order of the moves.  Raises ValueError for less than four seconds.
    """
    if not duration_s >= 4.0:
        raise ValueError(f"duration_s = {duration_s}: allowed: 4 or more seconds")
    manner, moves = boxing_style(person.seed), boxing_moves(person, duration_s, seed)
    standing = neutral(person)

    def pose_at(time_s: float) -> PersonPose:
        enter = minimum_jerk(time_s / ENTER_S) * minimum_jerk((duration_s - time_s) / ENTER_S)
        if enter <= 0.0:
            return standing
        pose = _arms(person, manner, moves, _body(person, manner, moves, time_s), time_s)
        return pose if enter >= 1.0 else _entering(standing, pose, enter)

    return Motion(duration_s, pose_at)


def _body(person: Person, manner: BoxingStyle, moves: list[Move], time_s: float) -> PersonPose:
    """Pose without the arms."""
    standing, leg = neutral(person), person.lengths.thigh + person.lengths.shank
    lead, rear = manner.lead, 1 - manner.lead
    side = OUTWARD[lead]  # +1 when the left side leads: the body is rotated to the right
    wave = np.sin(2.0 * np.pi * manner.bounce_hz * time_s + manner.phase)
    slow = np.sin(2.0 * np.pi * 0.45 * time_s + 2.0 * manner.phase)
    feet = np.zeros((2, 5))
    feet[lead] = side * 0.13 * leg, 0.27 * leg, -side * 0.25, 0.0, 0.06
    feet[rear] = -side * 0.14 * leg, -0.30 * leg, -side * 0.95, 0.0, 0.28 + 0.06 * wave
    pelvis, spine, head = np.zeros(6), standing.spine.copy(), standing.head.copy()
    pelvis[[Pelvis.X, Pelvis.Z]] = 0.012 * slow, 0.02 * wave
    pelvis[Pelvis.DROP] = (manner.depth + 0.010 * wave) * leg
    pelvis[Pelvis.YAW] = -side * manner.turned
    pelvis[Pelvis.TILT] = 0.06
    spine += np.array([0.16 + 0.02 * slow, 0.03 * slow, side * 0.20 * manner.turned])
    head += np.array([0.02, side * 0.65 * manner.turned])
    for move in moves:
        if time_s < move.start_s:
            continue
        if move.name == "shuffle":
            _shuffle(move, time_s, lead, feet, pelvis)
        elif move.name.startswith("slip"):
            out = 1.0 if move.name == "slip-left" else -1.0
            dip = move.pulse(time_s, 0.45)
            pelvis[Pelvis.DROP] += 0.07 * leg * dip
            pelvis[Pelvis.X] += 0.05 * leg * out * dip
            pelvis[Pelvis.ROLL] -= 0.05 * out * dip
            spine += np.array([0.14, -0.30 * out, 0.10 * out]) * dip
            head[1] -= 0.10 * out * dip
        else:
            _throw(move, time_s, side, rear, pelvis, spine, head, feet)
    return replace(standing, pelvis=pelvis, spine=spine, head=head, feet=feet)


def _throw(
    move: Move, time_s: float, side: float, rear: int, pelvis: Floats, spine: Floats, head: Floats, feet: Floats
) -> None:
    """Rotation of the body into a punch: the side of the fist moves forward."""
    hit = move.pulse(time_s, 0.42)
    turn = TURNS[move.name]
    twist = side * turn * hit
    pelvis[Pelvis.YAW] += 0.50 * twist
    spine[2] += 0.55 * twist
    head[1] -= 0.95 * twist
    pelvis[Pelvis.Z] += (0.03 if move.name == "jab" else 0.05) * hit
    spine[0] += 0.06 * hit
    if move.name.endswith("uppercut"):
        load = move.pulse(time_s, 0.20) - 0.4 * hit
        pelvis[Pelvis.DROP] += 0.05 * load
        spine[0] += 0.08 * load
    if turn > 0.0:  # the rear heel rotates outwards and rises
        feet[rear, Foot.HEEL] += 0.30 * hit
        feet[rear, Foot.YAW] += 0.35 * side * hit


def _shuffle(move: Move, time_s: float, lead: int, feet: Floats, pelvis: Floats) -> None:
    """Shuffle: the foot on the side of the movement steps first, the other follows."""
    x, z = move.aim
    lead_first = z >= 0.0
    for foot in SIDES:
        first = (foot == lead) == lead_first
        start, end = (0.0, 0.55) if first else (0.42, 1.0)
        done = move.done(time_s, start, end)
        feet[foot, Foot.X] += x * done
        feet[foot, Foot.Z] += z * done
        feet[foot, Foot.LIFT] += 0.035 * np.sin(np.pi * done) ** 2
    done = move.done(time_s, 0.05, 0.95)
    pelvis[Pelvis.X] += x * done
    pelvis[Pelvis.Z] += z * done


def _arms(person: Person, manner: BoxingStyle, moves: list[Move], pose: PersonPose, time_s: float) -> PersonPose:
    bones = pose_bones(person, pose)
    size = person.lengths
    for side in SIDES:
        out = OUTWARD[side]
        wide, high, front = manner.guard
        # The guard follows the face.
        wrist = ry(float(pose.head[1])) @ np.array([out * wide, high + 0.30 * size.head_top, front * 0.9])
        wrist[1] -= 0.02 * np.sin(2.0 * np.pi * manner.bounce_hz * time_s + manner.phase + out)
        elbow = np.array([out * manner.arms[0], -1.0, -0.1])
        for move in moves:
            if move.name in PUNCHES and move.start_s < time_s < move.start_s + move.duration_s:
                by_lead = move.name == "jab" or move.name.startswith("lead")
                if (side == manner.lead) == by_lead:
                    hit = move.pulse(time_s, 0.42)
                    goal, points = _goal(person, move, side)
                    wrist = wrist + min(hit, 1.05) * (in_chest(bones, bones.origin[HEAD] + goal) - wrist)
                    if move.name.endswith("uppercut"):
                        wrist = wrist + np.array([0.0, -0.22, -0.02]) * np.sin(np.pi * min(hit, 1.0)) ** 2
                    elbow = elbow + min(hit, 1.0) * (points - elbow)
        pose = reach_goal(person, pose, side, ArmGoal(wrist, elbow))
    return pose


def _goal(person: Person, move: Move, side: int) -> tuple[Floats, Floats]:
    """Target (3,) of a punch, from the base of the neck in world axes, and the direction of its elbow."""
    arm, out = person.lengths.upper_arm + person.lengths.forearm, OUTWARD[side]
    aim = np.array([move.aim[0], move.aim[1], 0.0])
    if move.name in ("jab", "cross"):
        return np.array([out * 0.02, 0.03, 1.12 * arm]) + aim, np.array([out * 0.7, -0.8, 0.0])
    if move.name.endswith("hook"):
        return np.array([-out * 0.08, 0.02, 0.62 * arm]) + aim, np.array([out * 1.0, 0.05, -0.15])
    return np.array([-out * 0.02, 0.02, 0.60 * arm]) + aim, np.array([out * 0.5, -1.0, 0.2])


def _entering(standing: PersonPose, pose: PersonPose, share: float) -> PersonPose:
    """Transition into or out of the guard: first one foot steps, then the other."""
    entered = interpolate(standing, pose, share)
    feet = entered.feet.copy()
    for side in SIDES:
        start = 0.0 if side == LEFT else 0.45
        done = minimum_jerk((share - start) / 0.55)
        feet[side] = standing.feet[side] + done * (pose.feet[side] - standing.feet[side])
        feet[side, Foot.LIFT] += 0.04 * np.sin(np.pi * done) ** 2
    return replace(entered, feet=feet)
