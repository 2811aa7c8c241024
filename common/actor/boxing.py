"""Boxing: a guard that never stands still, and jabs, crosses, hooks, uppercuts, slips and shuffles in random order."""

from dataclasses import replace

import numpy as np

from common.actor.boxing_moves import ENTER_S, PUNCHES, BoxingManner, Move, boxing_manner, boxing_moves
from common.actor.person import Person
from common.actor.pose import (
    DROP,
    FOOT_X,
    FOOT_YAW,
    FOOT_Z,
    HEEL,
    LEFT,
    LIFT,
    OUTWARD,
    ROLL,
    SIDES,
    TILT,
    YAW,
    ActorPose,
    Motion,
    X,
    Z,
    between,
    ease,
    neutral,
)
from common.actor.reaching import Reach, in_chest, reaching
from common.actor.rotation import Floats, ry
from common.actor.skeleton import HEAD, pose_bones

# Of hips and chest together, to the lead side's back, radians.
TURNS = {"jab": -0.26, "lead-hook": -0.60, "lead-uppercut": -0.45, "cross": 0.62, "rear-hook": 0.65, "rear-uppercut": 0.50}


def box(person: Person, duration_s: float, seed: int) -> Motion:
    """Shadow boxing towards +Z for duration_s seconds, from standing until standing again.

    seed: 0 or more, the order of the moves.  Raises ValueError for less than four seconds.
    """
    if not duration_s >= 4.0:
        raise ValueError(f"duration_s = {duration_s}: allowed: 4 or more seconds")
    manner, moves = boxing_manner(person.seed), boxing_moves(person, duration_s, seed)
    standing = neutral(person)

    def pose_at(time_s: float) -> ActorPose:
        enter = ease(time_s / ENTER_S) * ease((duration_s - time_s) / ENTER_S)
        if enter <= 0.0:
            return standing
        pose = _arms(person, manner, moves, _body(person, manner, moves, time_s), time_s)
        return pose if enter >= 1.0 else _entering(standing, pose, enter)

    return Motion(duration_s, pose_at)


def _body(person: Person, manner: BoxingManner, moves: list[Move], time_s: float) -> ActorPose:
    """All but the arms."""
    standing, leg = neutral(person), person.lengths.thigh + person.lengths.shank
    lead, rear = manner.lead, 1 - manner.lead
    side = OUTWARD[lead]  # +1 when the left leads: the body is turned to the right
    wave = np.sin(2.0 * np.pi * manner.bounce_hz * time_s + manner.phase)
    slow = np.sin(2.0 * np.pi * 0.45 * time_s + 2.0 * manner.phase)
    feet = np.zeros((2, 5))
    feet[lead] = side * 0.13 * leg, 0.27 * leg, -side * 0.25, 0.0, 0.06
    feet[rear] = -side * 0.14 * leg, -0.30 * leg, -side * 0.95, 0.0, 0.28 + 0.06 * wave
    pelvis, spine, head = np.zeros(6), standing.spine.copy(), standing.head.copy()
    pelvis[[X, Z]] = 0.012 * slow, 0.02 * wave
    pelvis[DROP] = (manner.depth + 0.010 * wave) * leg
    pelvis[YAW] = -side * manner.turned
    pelvis[TILT] = 0.06
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
            pelvis[DROP] += 0.07 * leg * dip
            pelvis[X] += 0.05 * leg * out * dip
            pelvis[ROLL] -= 0.05 * out * dip
            spine += np.array([0.14, -0.30 * out, 0.10 * out]) * dip
            head[1] -= 0.10 * out * dip
        else:
            _throw(move, time_s, side, rear, pelvis, spine, head, feet)
    return replace(standing, pelvis=pelvis, spine=spine, head=head, feet=feet)


def _throw(
    move: Move, time_s: float, side: float, rear: int, pelvis: Floats, spine: Floats, head: Floats, feet: Floats
) -> None:
    """The body's turn into a punch: the fist's own side goes forward."""
    hit = move.pulse(time_s, 0.42)
    turn = TURNS[move.name]
    twist = side * turn * hit
    pelvis[YAW] += 0.50 * twist
    spine[2] += 0.55 * twist
    head[1] -= 0.95 * twist
    pelvis[Z] += (0.03 if move.name == "jab" else 0.05) * hit
    spine[0] += 0.06 * hit
    if move.name.endswith("uppercut"):
        load = move.pulse(time_s, 0.20) - 0.4 * hit
        pelvis[DROP] += 0.05 * load
        spine[0] += 0.08 * load
    if turn > 0.0:  # the rear heel turns out and comes up
        feet[rear, HEEL] += 0.30 * hit
        feet[rear, FOOT_YAW] += 0.35 * side * hit


def _shuffle(move: Move, time_s: float, lead: int, feet: Floats, pelvis: Floats) -> None:
    """The foot on the side of the way goes first, the other follows."""
    x, z = move.aim
    lead_first = z >= 0.0
    for foot in SIDES:
        first = (foot == lead) == lead_first
        start, end = (0.0, 0.55) if first else (0.42, 1.0)
        done = move.done(time_s, start, end)
        feet[foot, FOOT_X] += x * done
        feet[foot, FOOT_Z] += z * done
        feet[foot, LIFT] += 0.035 * np.sin(np.pi * done) ** 2
    done = move.done(time_s, 0.05, 0.95)
    pelvis[X] += x * done
    pelvis[Z] += z * done


def _arms(person: Person, manner: BoxingManner, moves: list[Move], pose: ActorPose, time_s: float) -> ActorPose:
    bones = pose_bones(person, pose)
    size = person.lengths
    for side in SIDES:
        out = OUTWARD[side]
        wide, high, front = manner.guard
        # The guard is held before the face, wherever the face goes.
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
        pose = reaching(person, pose, side, Reach(wrist, elbow))
    return pose


def _goal(person: Person, move: Move, side: int) -> tuple[Floats, Floats]:
    """Where a punch goes, (3,) from the base of the neck in the axes of the world, and where its elbow points."""
    arm, out = person.lengths.upper_arm + person.lengths.forearm, OUTWARD[side]
    aim = np.array([move.aim[0], move.aim[1], 0.0])
    if move.name in ("jab", "cross"):
        return np.array([out * 0.02, 0.03, 1.12 * arm]) + aim, np.array([out * 0.7, -0.8, 0.0])
    if move.name.endswith("hook"):
        return np.array([-out * 0.08, 0.02, 0.62 * arm]) + aim, np.array([out * 1.0, 0.05, -0.15])
    return np.array([-out * 0.02, 0.02, 0.60 * arm]) + aim, np.array([out * 0.5, -1.0, 0.2])


def _entering(standing: ActorPose, pose: ActorPose, share: float) -> ActorPose:
    """On the way into the guard, or out of it: first one foot steps, then the other."""
    entered = between(standing, pose, share)
    feet = entered.feet.copy()
    for side in SIDES:
        start = 0.0 if side == LEFT else 0.45
        done = ease((share - start) / 0.55)
        feet[side] = standing.feet[side] + done * (pose.feet[side] - standing.feet[side])
        feet[side, LIFT] += 0.04 * np.sin(np.pi * done) ** 2
    return replace(entered, feet=feet)
