"""Time lines of the simulated person: sequence of motions, from the empty scene to the last pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.simulation.body.person import Person, person
from zenocap.simulation.body.pose import (
    Arm,
    Motion,
    Pelvis,
    PersonPose,
    Placement,
    compose,
    interpolate,
    minimum_jerk,
    neutral,
    place,
)
from zenocap.simulation.motion.activities import ACTIVITIES, activity
from zenocap.simulation.motion.boxing import box
from zenocap.simulation.motion.footsteps import circle_path, return_path, turning_path, walk
from zenocap.simulation.motion.gait_styles import run
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.postures import posture

EMPTY, STRETCHED, LOWERING, RAISING = "empty", "stretched", "lowering", "raising"
STANDING, RETURNING = "standing", "returning"
RUNNING_S, BOXING_S = 12.0, 20.0
BEFORE_RETURN_S = 1.0


@dataclass(frozen=True)
class Segment:
    """One named segment of a time line, seconds; `motion` starts at `start`, None is the empty scene."""

    name: str
    start_s: float
    end_s: float
    start: Placement
    motion: Motion | None


Part = tuple[str, float, Motion | None]  # name, duration (s), motion; None for the empty scene


@dataclass(frozen=True)
class MotionTimeline:
    """A person's time line.

    segments: in order of time, without gaps.  motion_from_s: when the first motion after the T-pose starts.
    period_s: the last `period_s` seconds are repeated, so that the empty scene at the start appears once; None for a time
    line that ends with standing.
    """

    person: Person
    seed: int
    segments: tuple[Segment, ...]
    motion_from_s: float
    period_s: float | None = None

    @property
    def duration_s(self) -> float:
        """End of the last segment, seconds."""
        return self.segments[-1].end_s

    def segment_at(self, time_s: float) -> Segment:
        """The segment at a time in seconds from the start; the last one after the end."""
        within_s = self._once_through(time_s)
        return next((s for s in self.segments if within_s < s.end_s), self.segments[-1])

    def pose_at(self, time_s: float) -> PersonPose | None:
        """The pose at a time in seconds from the start; None while the scene is empty."""
        segment = self.segment_at(time_s)
        if segment.motion is None:
            return None
        within_s = min(self._once_through(time_s) - segment.start_s, segment.motion.duration_s)
        return _alive(self.person, place(segment.motion.pose_at(within_s), segment.start), self.seed, time_s)

    def _once_through(self, time_s: float) -> float:
        if not time_s >= 0.0:
            raise ValueError(f"script: time_s = {time_s}, allowed 0 or more")
        if self.period_s is None or time_s < self.duration_s:
            return time_s
        loop_from_s = self.duration_s - self.period_s
        return loop_from_s + (time_s - loop_from_s) % self.period_s


def performance(name: str, seed: int) -> MotionTimeline:
    """`demo_timeline`, for the name "demo", or `motion_timeline` of the person of a seed.  Raises as that one does."""
    subject = person(seed)
    return demo_timeline(subject, seed) if name == "demo" else motion_timeline(subject, name, seed)


def posture_timeline(person: Person, posture_name: str, seed: int) -> MotionTimeline:
    """Empty scene 1 s, T-pose 1.5 s, arms down 0.6 s, then one repetition of a posture.

    seed: 0 or more, the repetition.  Raises ValueError for a name not in POSTURES.
    """
    motion = posture(person, posture_name, seed)
    return _script(person, seed, [*_short_opening(person), (posture_name, *_timed(motion))])


def session_timeline(
    person: Person, movements: Sequence[tuple[str, int]], pauses_s: Sequence[float], seed: int
) -> MotionTimeline:
    """Empty scene 1 s, T-pose 1.5 s, arms down 0.6 s, then movements, each after its pause of standing.

    movements: name of a posture or everyday movement, and its repetition.  pauses_s: one per movement, 0 for none.  After
    a movement that ends elsewhere, the person walks back after 1 s.  Raises ValueError for another name.
    """
    standing = _held(neutral(person))
    parts = _short_opening(person)
    for (name, number), pause_s in zip(movements, pauses_s, strict=True):
        if name not in (*POSTURES, *ACTIVITIES):
            raise ValueError(f"movement {name!r} is not one of {', '.join((*POSTURES, *ACTIVITIES))}")
        motion = posture(person, name, number) if name in POSTURES else activity(person, name, number)
        if pause_s > 0.0:
            parts.append((STANDING, pause_s, standing))
        parts.append((name, *_timed(motion)))
        if np.hypot(motion.end.x, motion.end.z) > 0.1:
            back = walk(person, return_path(motion.end, 0.27 * person.height), 0.5)
            parts += [(STANDING, BEFORE_RETURN_S, standing), (RETURNING, *_timed(back))]
    return _script(person, seed, [*parts, (STANDING, 1.0, standing)])


def demo_timeline(person: Person, seed: int) -> MotionTimeline:
    """Empty scene 3 s, then a loop of T-pose, walking, arms, squatting, kicking, arms and turning."""
    standing = _held(neutral(person))
    parts: list[Part] = [*_opening(person), ("walking", *_timed(_walking(person))), (STANDING, 0.4, standing)]
    arms, legs = ("raise-both-arms", "raise-right-arm", "swing-both-arms"), ("squat", "kick-right", "kick-left")
    # Repetition 4 of the left arm: of 0, 1 and 4 it is recognized with the largest score after this right arm.
    for name, number in (*((name, 0) for name in (*arms, *legs, "raise-right-arm")), ("raise-left-arm", 4)):
        parts += [(name, *_timed(posture(person, name, seed + number))), (STANDING, 0.4, standing)]
    parts += [
        ("turning", *_timed(_turning(person))),
        (STANDING, 0.4, standing),
        (RAISING, 0.8, _blended(neutral(person), t_pose(person), 0.8)),
    ]
    return _script(person, seed, parts, period_from=STRETCHED)


def motion_timeline(person: Person, name: str, seed: int) -> MotionTimeline:
    """Empty scene 3 s, the T-pose, then one motion in a loop.

    name: `walking`, `turning`, `running` (a small circle), `boxing` or a posture.  After a motion that ends elsewhere,
    the person walks back.  Raises ValueError for any other name.
    """
    match name:
        case "walking":
            motion = _walking(person)
        case "turning":
            motion = _turning(person)
        case "running":
            motion = run(person, 1.9, seed, RUNNING_S, -1.3)
        case "boxing":
            motion = box(person, BOXING_S, seed)
        case _:
            motion = posture(person, name, seed)
    parts: list[Part] = [*_opening(person), (name, *_timed(motion))]
    if np.hypot(motion.end.x, motion.end.z) > 0.1:
        parts.append((RETURNING, *_timed(walk(person, return_path(motion.end, 0.27 * person.height), 0.5))))
    parts.append((STANDING, 0.4, _held(neutral(person))))
    return _script(person, seed, parts, period_from=name)


def _short_opening(person: Person) -> list[Part]:
    lowering = _blended(t_pose(person), neutral(person), 0.6)
    return [(EMPTY, 1.0, None), (STRETCHED, 1.5, _held(t_pose(person))), (LOWERING, 0.6, lowering)]


def _opening(person: Person) -> list[Part]:
    lowering = _blended(t_pose(person), neutral(person), 0.8)
    return [(EMPTY, 3.0, None), (STRETCHED, 3.0, _held(t_pose(person))), (LOWERING, 0.8, lowering)]


def _walking(person: Person) -> Motion:
    radius = 0.75
    steps = round(2.0 * np.pi * radius / (0.27 * person.height))
    return walk(person, circle_path(radius, steps), 0.55 / person.manner.tempo)


def _turning(person: Person) -> Motion:
    return walk(person, turning_path(2.0 * np.pi, 8), 0.48 / person.manner.tempo, arms=0.5)


def _timed(motion: Motion) -> tuple[float, Motion]:
    return motion.duration_s, motion


def t_pose(person: Person) -> PersonPose:
    """The T-pose: straight, arms horizontally sideways, facing +Z."""
    pose = neutral(person)
    arms = pose.arms.copy()
    arms[:, Arm.ABDUCTION], arms[:, Arm.FLEXION], arms[:, Arm.ELBOW] = np.radians(90.0), 0.0, np.radians(3.0)
    return replace(pose, arms=arms, spine=np.array([0.3, 1.0, 1.0]) * pose.spine)


def _held(pose: PersonPose) -> Motion:
    return Motion(0.0, lambda _time_s: pose)


def _blended(first: PersonPose, second: PersonPose, duration_s: float) -> Motion:
    return Motion(duration_s, lambda time_s: interpolate(first, second, minimum_jerk(time_s / duration_s)))


def _script(person: Person, seed: int, parts: list[Part], period_from: str = "") -> MotionTimeline:
    segments, time_s, at = [], 0.0, Placement()
    motion_from_s = 0.0
    for name, duration_s, motion in parts:
        segments.append(Segment(name, time_s, time_s + duration_s, at, motion))
        time_s += duration_s
        if motion is not None:
            at = compose(at, motion.end)
        if name == LOWERING:
            motion_from_s = time_s
    period_s = next((time_s - s.start_s for s in segments if s.name == period_from), None)
    return MotionTimeline(person, seed, tuple(segments), motion_from_s, period_s)


def _alive(person: Person, pose: PersonPose, seed: int, time_s: float) -> PersonPose:
    """Add slow sway of the body, breathing in the arms, and small rotations of the head."""
    phase = np.random.default_rng([0x23, person.seed, seed]).uniform(0.0, 2.0 * np.pi, 8)
    rate = 2.0 * np.pi * np.array([0.31, 0.23, 0.37, 0.19, 0.27, 0.41, 0.17, 0.13])
    wave = np.sin(rate * time_s + phase)
    sway = person.manner.sway
    pelvis, spine, head, arms = pose.pelvis.copy(), pose.spine.copy(), pose.head.copy(), pose.arms.copy()
    pelvis[Pelvis.X] += sway * wave[0]
    pelvis[Pelvis.Z] += sway * wave[1]
    pelvis[Pelvis.ROLL] += 0.5 * sway * wave[0]
    pelvis[Pelvis.TILT] += 0.8 * sway * wave[1]
    spine += 1.5 * sway * wave[2:5]
    head += np.array([3.0, 6.0]) * sway * wave[5:7]
    arms[:, Arm.FLEXION] += np.array([2.0, -2.0]) * sway * wave[7] + sway * wave[2]
    arms[:, Arm.ABDUCTION] += 1.5 * sway * wave[3]
    return replace(pose, pelvis=pelvis, spine=spine, head=head, arms=arms)
