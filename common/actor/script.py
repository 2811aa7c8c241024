"""Time lines of the actor: which motion runs when, from the empty scene to the last pose."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from common.actor.boxing import box
from common.actor.everyday import EVERYDAY, everyday
from common.actor.person import Person
from common.actor.pose import (
    ABDUCTION,
    ELBOW,
    FLEXION,
    ROLL,
    TILT,
    ActorPose,
    Motion,
    Placement,
    X,
    Z,
    between,
    chain,
    ease,
    neutral,
    place,
)
from common.actor.postures import posture
from common.actor.running import run
from common.actor.style import POSTURES
from common.actor.walking import circle_way, turn_way, walk, way_home

EMPTY, STRETCHED, LOWERING, RAISING = "empty", "stretched", "lowering", "raising"
STANDING, RETURNING = "standing", "returning"
RUNNING_S, BOXING_S = 12.0, 20.0
BEFORE_RETURN_S = 1.0


@dataclass(frozen=True)
class Segment:
    """One named stretch of a script in seconds; `motion` starts at `start`, None is the empty scene."""

    name: str
    start_s: float
    end_s: float
    start: Placement
    motion: Motion | None


Part = tuple[str, float, Motion | None]  # name, seconds, what to do


@dataclass(frozen=True)
class Script:
    """A person's time line.

    segments: in order of time, without gaps.  motion_from_s: when the first motion after the initial posture starts.
    period_s: how long it takes to come round, None for a script that ends and then stands; what repeats is the last
    `period_s` seconds, so that the empty scene at the start is seen once.
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
        """The segment that runs at a time in seconds from the start; the last one after the end."""
        within_s = self._once_through(time_s)
        return next((s for s in self.segments if within_s < s.end_s), self.segments[-1])

    def pose_at(self, time_s: float) -> ActorPose | None:
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


def posture_take(person: Person, posture_name: str, seed: int) -> Script:
    """Empty scene 1 s, initial posture 1.5 s, arms down 0.6 s, then one repetition of a posture.

    seed: 0 or more, the repetition.  Raises ValueError for a name not in POSTURES.
    """
    motion = posture(person, posture_name, seed)
    return _script(person, seed, [*_short_opening(person), (posture_name, *_timed(motion))])


def session(person: Person, movements: Sequence[tuple[str, int]], pauses_s: Sequence[float], seed: int) -> Script:
    """Empty scene 1 s, initial posture 1.5 s, arms down 0.6 s, then movements, each after its pause of standing.

    movements: a posture or everyday movement, and its repetition.  pauses_s: as many, 0 for none.  Whoever ends elsewhere
    walks back after a second.  Raises ValueError for another name.
    """
    standing = _held(neutral(person))
    parts = _short_opening(person)
    for (name, number), pause_s in zip(movements, pauses_s, strict=True):
        if name not in (*POSTURES, *EVERYDAY):
            raise ValueError(f"movement {name!r} is not one of {', '.join((*POSTURES, *EVERYDAY))}")
        motion = posture(person, name, number) if name in POSTURES else everyday(person, name, number)
        if pause_s > 0.0:
            parts.append((STANDING, pause_s, standing))
        parts.append((name, *_timed(motion)))
        if np.hypot(motion.end.x, motion.end.z) > 0.1:
            back = walk(person, way_home(motion.end, 0.27 * person.height), 0.5)
            parts += [(STANDING, BEFORE_RETURN_S, standing), (RETURNING, *_timed(back))]
    return _script(person, seed, [*parts, (STANDING, 1.0, standing)])


def demo_script(person: Person, seed: int) -> Script:
    """Empty scene 3 s, then for ever: initial posture, walking, arms, squatting, kicking, turning, and round again."""
    standing = _held(neutral(person))
    parts: list[Part] = [
        *_opening(person),
        ("walking", *_timed(_walking(person))),
        (STANDING, 0.4, standing),
    ]
    for name in ("raise-both-arms", "raise-right-arm", "swing-both-arms", "squat", "kick-right", "kick-left"):
        parts += [(name, *_timed(posture(person, name, seed))), (STANDING, 0.4, standing)]
    parts += [
        ("turning", *_timed(_turning(person))),
        (STANDING, 0.4, standing),
        (RAISING, 0.8, _blended(neutral(person), stretched(person), 0.8)),
    ]
    return _script(person, seed, parts, period_from=STRETCHED)


def motion_script(person: Person, name: str, seed: int) -> Script:
    """Empty scene 3 s, the initial posture, then one motion over and over.

    name: `walking`, `turning`, `running` (a small circle), `boxing` or a posture.  Whoever ends elsewhere walks back.
    Raises ValueError for any other name.
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
        parts.append((RETURNING, *_timed(walk(person, way_home(motion.end, 0.27 * person.height), 0.5))))
    parts.append((STANDING, 0.4, _held(neutral(person))))
    return _script(person, seed, parts, period_from=name)


def _short_opening(person: Person) -> list[Part]:
    lowering = _blended(stretched(person), neutral(person), 0.6)
    return [(EMPTY, 1.0, None), (STRETCHED, 1.5, _held(stretched(person))), (LOWERING, 0.6, lowering)]


def _opening(person: Person) -> list[Part]:
    lowering = _blended(stretched(person), neutral(person), 0.8)
    return [(EMPTY, 3.0, None), (STRETCHED, 3.0, _held(stretched(person))), (LOWERING, 0.8, lowering)]


def _walking(person: Person) -> Motion:
    radius = 0.75
    steps = round(2.0 * np.pi * radius / (0.27 * person.height))
    return walk(person, circle_way(radius, steps), 0.55 / person.manner.tempo)


def _turning(person: Person) -> Motion:
    return walk(person, turn_way(2.0 * np.pi, 8), 0.48 / person.manner.tempo, arms=0.5)


def _timed(motion: Motion) -> tuple[float, Motion]:
    return motion.duration_s, motion


def stretched(person: Person) -> ActorPose:
    """The initial posture: straight, arms stretched horizontally sideways, facing +Z."""
    pose = neutral(person)
    arms = pose.arms.copy()
    arms[:, ABDUCTION], arms[:, FLEXION], arms[:, ELBOW] = np.radians(90.0), 0.0, np.radians(3.0)
    return replace(pose, arms=arms, spine=np.array([0.3, 1.0, 1.0]) * pose.spine)


def _held(pose: ActorPose) -> Motion:
    return Motion(0.0, lambda _time_s: pose)


def _blended(first: ActorPose, second: ActorPose, duration_s: float) -> Motion:
    return Motion(duration_s, lambda time_s: between(first, second, ease(time_s / duration_s)))


def _script(person: Person, seed: int, parts: list[Part], period_from: str = "") -> Script:
    segments, time_s, at = [], 0.0, Placement()
    motion_from_s = 0.0
    for name, duration_s, motion in parts:
        segments.append(Segment(name, time_s, time_s + duration_s, at, motion))
        time_s += duration_s
        if motion is not None:
            at = chain(at, motion.end)
        if name == LOWERING:
            motion_from_s = time_s
    period_s = next((time_s - s.start_s for s in segments if s.name == period_from), None)
    return Script(person, seed, tuple(segments), motion_from_s, period_s)


def _alive(person: Person, pose: ActorPose, seed: int, time_s: float) -> ActorPose:
    """Nobody stands still: slow sway of the body, breath in the arms, small turns of the head."""
    phase = np.random.default_rng([0x23, person.seed, seed]).uniform(0.0, 2.0 * np.pi, 8)
    rate = 2.0 * np.pi * np.array([0.31, 0.23, 0.37, 0.19, 0.27, 0.41, 0.17, 0.13])
    wave = np.sin(rate * time_s + phase)
    sway = person.manner.sway
    pelvis, spine, head, arms = pose.pelvis.copy(), pose.spine.copy(), pose.head.copy(), pose.arms.copy()
    pelvis[X] += sway * wave[0]
    pelvis[Z] += sway * wave[1]
    pelvis[ROLL] += 0.5 * sway * wave[0]
    pelvis[TILT] += 0.8 * sway * wave[1]
    spine += 1.5 * sway * wave[2:5]
    head += np.array([3.0, 6.0]) * sway * wave[5:7]
    arms[:, FLEXION] += np.array([2.0, -2.0]) * sway * wave[7] + sway * wave[2]
    arms[:, ABDUCTION] += 1.5 * sway * wave[3]
    return replace(pose, pelvis=pelvis, spine=spine, head=head, arms=arms)
