"""The fifteen postures of [Two-view 5] as smooth functions of time, with variation by repetition."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import (
    LEFT,
    OUTWARD,
    RIGHT,
    SIDES,
    Arm,
    Motion,
    Pelvis,
    PersonPose,
    Placement,
    Swing,
    minimum_jerk,
    neutral,
)
from zenocap.simulation.motion.footsteps import walk
from zenocap.simulation.motion.posture_style import POSTURES as POSTURES
from zenocap.simulation.motion.posture_style import PostureStyle, posture_style

# Paper (open): the postures of [Two-view Fig. 16], which our text lacks; our choice within the five movements of 5.
Course = Callable[[float], PersonPose]


def posture(person: Person, name: str, seed: int) -> Motion:
    """One repetition of a posture, beginning standing at the origin.  Raises ValueError for a name not in POSTURES.

    seed: 0 or more, the repetition; the person's habits do not depend on it.
    """
    if name not in POSTURES:
        raise ValueError(f"posture {name!r} is not one of {', '.join(POSTURES)}")
    style = posture_style(person, name, seed)
    if name == "turn-and-walk":
        return _turn_and_walk(person, style)
    course = _COURSES[name](person, style)
    return Motion(style.duration_s, course)


def _raise(sides: tuple[int, ...], bent: bool) -> Callable[[Person, PostureStyle], Course]:
    def course(person: Person, style: PostureStyle) -> Course:
        standing = neutral(person)

        def pose_at(time_s: float) -> PersonPose:
            arms, bend = standing.arms.copy(), 0.0
            for side in sides:
                up = style.pulse(time_s, ahead=0.01 * style.chance[side])
                if bent:
                    top = np.radians(92.0 + 14.0 * style.habit + 4.0 * style.chance[2]) * style.vigour
                    fold = np.radians(92.0 + 18.0 * style.habit + 6.0 * style.chance[3 + side])
                    # The arm rotates about its axis before it is raised, so that the forearm stays in the frontal plane.
                    arms[side, Arm.ROTATION] = minimum_jerk(2.5 * up) * np.radians(82.0 + 6.0 * style.chance[5])
                    arms[side, Arm.ELBOW] += up * (fold - arms[side, Arm.ELBOW])
                else:
                    top = np.radians(143.0 + 18.0 * style.habit + 5.0 * style.chance[2 + side]) * style.vigour
                    top = min(top, np.radians(172.0))
                arms[side, Arm.ABDUCTION] += up * (top - arms[side, Arm.ABDUCTION])
                arms[side, Arm.FLEXION] += up * np.radians(4.0 * style.chance[6])
                bend -= OUTWARD[side] * up
            spine = standing.spine + np.array([-0.02, 0.03 * bend, 0.0]) * abs(bend)
            pelvis = standing.pelvis.copy()
            pelvis[Pelvis.X] += 0.012 * bend
            return replace(standing, arms=arms, spine=spine, pelvis=pelvis)

        return pose_at

    return course


def _swing(sides: tuple[int, ...]) -> Callable[[Person, PostureStyle], Course]:
    def course(person: Person, style: PostureStyle) -> Course:
        standing = neutral(person)
        top = np.radians(122.0 + 26.0 * style.habit + 6.0 * style.chance[2]) * style.vigour
        back = np.radians(18.0 + 5.0 * style.chance[3])

        def pose_at(time_s: float) -> PersonPose:
            arms, u = standing.arms.copy(), time_s / style.duration_s
            forward = 0.0
            for side in sides:
                up = style.pulse(time_s, ahead=0.008 * style.chance[side])
                before = np.sin(np.pi * np.clip((u - 0.01) / 0.20, 0.0, 1.0)) ** 2
                after = np.sin(np.pi * np.clip((u - 0.84) / 0.15, 0.0, 1.0)) ** 2
                arms[side, Arm.FLEXION] += up * top - back * (before + 0.6 * after) * (1.0 - up)
                arms[side, Arm.ABDUCTION] *= 1.0 - 0.75 * up
                arms[side, Arm.ELBOW] *= 1.0 - 0.4 * up
                forward += up
            one = 1.0 if len(sides) == 1 else 0.0
            turn = one * OUTWARD[sides[0]] * -0.07 * forward
            return replace(standing, arms=arms, spine=standing.spine + np.array([-0.03 * forward, 0.0, turn]))

        return pose_at

    return course


def _squat(arms_to: str) -> Callable[[Person, PostureStyle], Course]:
    def course(person: Person, style: PostureStyle) -> Course:
        standing = neutral(person)
        leg = person.lengths.thigh + person.lengths.shank
        depth = leg * float(np.clip((0.30 + 0.07 * style.habit + 0.02 * style.chance[2]) * style.vigour, 0.20, 0.42))
        lean = np.radians(20.0 + 7.0 * style.habit + 3.0 * style.chance[3])

        def pose_at(time_s: float) -> PersonPose:
            down = style.pulse(time_s)
            arms, pelvis, spine = standing.arms.copy(), standing.pelvis.copy(), standing.spine.copy()
            pelvis[Pelvis.DROP] += down * depth
            pelvis[Pelvis.Z] -= down * 0.28 * depth
            pelvis[Pelvis.TILT] += down * 0.6 * lean
            spine[0] += down * 0.4 * lean
            moved = style.pulse(time_s, ahead=0.02 * style.chance[4])
            if arms_to == "sideways":
                arms[:, Arm.ABDUCTION] += moved * (np.radians(88.0 + 4.0 * style.chance[5]) - arms[:, Arm.ABDUCTION])
            elif arms_to == "forward":
                arms[:, Arm.FLEXION] += moved * (np.radians(86.0 + 5.0 * style.chance[5]) + lean)
                arms[:, Arm.ABDUCTION] *= 1.0 - 0.6 * moved
            else:
                arms[:, Arm.FLEXION] += down * (lean + np.radians(4.0))
            head = standing.head - np.array([0.5 * down * lean, 0.0])
            return replace(standing, arms=arms, pelvis=pelvis, spine=spine, head=head)

        return pose_at

    return course


def _kick(side: int, arms_sideways: bool) -> Callable[[Person, PostureStyle], Course]:
    def course(person: Person, style: PostureStyle) -> Course:
        standing = neutral(person)
        top = np.radians(64.0 + 10.0 * style.habit + 4.0 * style.chance[2]) * style.vigour
        back, fold = np.radians(10.0 + 3.0 * style.chance[3]), np.radians(58.0 + 8.0 * style.chance[4])

        def pose_at(time_s: float) -> PersonPose:
            u = time_s / style.duration_s
            up = style.pulse(time_s)
            draw = np.sin(np.pi * np.clip((u - 0.02) / 0.26, 0.0, 1.0)) ** 2
            swing = standing.swing.copy()
            # The knee bends while the leg moves back and begins to rise, extends at the top, and bends on the way down.
            folded = np.sin(np.pi * np.clip((u - 0.02) / 0.42, 0.0, 1.0)) ** 2
            given = np.sin(np.pi * np.clip((u - 0.52) / 0.42, 0.0, 1.0)) ** 2
            swing[side] = up * top - back * draw * (1.0 - up), 0.03 * up, fold * folded + 0.6 * fold * given
            pelvis, arms = standing.pelvis.copy(), standing.arms.copy()
            weight = max(up, float(draw))
            pelvis[Pelvis.X] -= OUTWARD[side] * 0.65 * person.manner.stance_half * minimum_jerk(weight)
            pelvis[Pelvis.ROLL] += OUTWARD[side] * -0.03 * up
            pelvis[Pelvis.TILT] -= 0.07 * up
            other = 1 - side
            if arms_sideways:
                spread = style.pulse(time_s, ahead=0.03 + 0.01 * style.chance[5])
                arms[:, Arm.ABDUCTION] += spread * (np.radians(88.0 + 4.0 * style.chance[6]) - arms[:, Arm.ABDUCTION])
            else:
                arms[other, Arm.FLEXION] += np.radians(16.0) * up
                arms[side, Arm.FLEXION] -= np.radians(12.0) * up
                arms[:, Arm.ABDUCTION] += np.radians(7.0) * up
            return replace(standing, arms=arms, pelvis=pelvis, swing=swing)

        return pose_at

    return course


def _march(person: Person, style: PostureStyle) -> Course:
    standing = neutral(person)
    hip = np.radians(66.0 + 10.0 * style.habit + 4.0 * style.chance[2]) * style.vigour
    knee = hip * (1.28 + 0.05 * style.chance[3])
    lifts, first = 4, RIGHT if style.habit > -0.6 else LEFT
    begin, each = style.onset, (0.97 - style.onset) / lifts

    def pose_at(time_s: float) -> PersonPose:
        u = time_s / style.duration_s
        up = np.zeros(2)
        for k in range(lifts):
            phase = (u - begin - k * each) / (1.08 * each)
            high = 1.0 + 0.06 * style.chance[4 + k % 3]
            up[(first + k) % 2] += high * np.sin(np.pi * np.clip(phase, 0.0, 1.0)) ** 2
        swing, arms, pelvis = standing.swing.copy(), standing.arms.copy(), standing.pelvis.copy()
        for side in SIDES:
            swing[side, Swing.HIP], swing[side, Swing.KNEE] = hip * up[side], knee * up[side]
            swing[side, Swing.APART] = 0.02 * up[side]
            arms[side, Arm.FLEXION] += np.radians(26.0) * style.vigour * (up[1 - side] - 0.7 * up[side])
            arms[side, Arm.ELBOW] += np.radians(22.0) * up[1 - side]
        pelvis[Pelvis.X] += 0.55 * person.manner.stance_half * (up[RIGHT] - up[LEFT])
        pelvis[Pelvis.ROLL] += 0.02 * (up[RIGHT] - up[LEFT])
        spine = standing.spine + np.array([0.0, 0.0, 0.05 * (up[LEFT] - up[RIGHT])])
        return replace(standing, swing=swing, arms=arms, pelvis=pelvis, spine=spine)

    return pose_at


def _turn_and_walk(person: Person, style: PostureStyle) -> Motion:
    """Turn to the left by about a quarter, then three steps; the person ends standing there."""
    turn = np.radians(88.0 + 4.0 * style.chance[2])
    stride = person.height * (0.20 + 0.025 * style.habit + 0.008 * style.chance[3]) * style.vigour
    way = [Placement(0.0, 0.0, 0.55 * turn), Placement(0.0, 0.0, turn)]
    for k in range(1, 4):
        way.append(Placement(k * stride * float(np.sin(turn)), k * stride * float(np.cos(turn)), turn))
    return walk(person, way, style.duration_s / (len(way) + 1), first=LEFT)


_COURSES: dict[str, Callable[[Person, PostureStyle], Course]] = {
    "march": _march,
    "raise-right-arm": _raise((RIGHT,), bent=False),
    "raise-left-arm": _raise((LEFT,), bent=False),
    "raise-both-arms": _raise((RIGHT, LEFT), bent=False),
    "raise-both-arms-bent": _raise((RIGHT, LEFT), bent=True),
    "swing-right-arm": _swing((RIGHT,)),
    "swing-left-arm": _swing((LEFT,)),
    "swing-both-arms": _swing((RIGHT, LEFT)),
    "squat": _squat(""),
    "squat-arms-sideways": _squat("sideways"),
    "squat-arms-forward": _squat("forward"),
    "kick-right": _kick(RIGHT, arms_sideways=False),
    "kick-left": _kick(LEFT, arms_sideways=False),
    "kick-right-arms-sideways": _kick(RIGHT, arms_sideways=True),
}
