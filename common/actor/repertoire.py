"""Long performances of one kind of motion, to learn from: the same kind, each seed another way of doing it."""

import numpy as np

from common.actor.boxing import box
from common.actor.everyday import EVERYDAY, everyday
from common.actor.person import Person
from common.actor.pose import ActorPose, Motion, Placement, chain, neutral, place
from common.actor.postures import posture
from common.actor.running import gait_of, run
from common.actor.style import POSTURES
from common.actor.walking import circle_way, turn_way, walk

KINDS = ("walking", "running", "boxing", "general")
BOUT_S = 24.0


def performance(person: Person, kind: str, seed: int) -> Motion:
    """About half a minute of a kind of motion, from standing at the origin.  Raises ValueError for a kind not in KINDS."""
    rng = np.random.default_rng([0x35, person.seed, seed])
    match kind:
        case "walking":
            return chained(person, [_walk(person, rng) for _ in range(4)])
        case "running":
            return chained(person, [_run(person, rng, 10 * seed + k) for k in range(4)])
        case "boxing":
            return box(person, BOUT_S, seed)
        case "general":
            return chained(person, _mixture(person, rng))
    raise ValueError(f"motion {kind!r} is not one of {', '.join(KINDS)}")


def chained(person: Person, motions: list[Motion], pause_s: float = 0.15) -> Motion:
    """One motion after the other, each from where the one before ended, standing still for pause_s between."""
    starts, places, time_s, at = [], [], 0.0, Placement()
    for motion in motions:
        starts.append(time_s)
        places.append(at)
        time_s += motion.duration_s + pause_s
        at = chain(at, motion.end)
    standing = neutral(person)

    def pose_at(time_s: float) -> ActorPose:
        k = max(int(np.searchsorted(starts, time_s, side="right")) - 1, 0)
        within_s = time_s - starts[k]
        if within_s > motions[k].duration_s:
            return place(standing, chain(places[k], motions[k].end))
        return place(motions[k].pose_at(within_s), places[k])

    return Motion(time_s, pose_at, at)


def _walk(person: Person, rng: np.random.Generator) -> Motion:
    stride = float(rng.uniform(0.25, 0.42)) * person.height
    # Who takes longer steps takes them faster.
    step_s = float(rng.uniform(0.93, 1.07)) * (0.68 - 0.38 * stride / person.height) / person.manner.tempo
    arms, count = float(rng.uniform(0.6, 1.3)), int(rng.integers(9, 14))
    kind = float(rng.uniform())
    if kind < 0.45:
        way = [Placement(0.0, stride * k) for k in range(1, count + 1)]
    elif kind < 0.9:
        radius = float(rng.uniform(1.0, 3.0))
        way = circle_way(radius, max(round(2.0 * np.pi * radius / stride), 8))[:count]
        if rng.uniform() < 0.5:
            way = [Placement(-p.x, p.z, -p.yaw) for p in way]
    else:
        way = turn_way(float(rng.uniform(1.5, 3.1) * rng.choice([-1.0, 1.0])), 5)
    return walk(person, way, step_s, first=int(rng.integers(2)), arms=arms)


def _run(person: Person, rng: np.random.Generator, seed: int) -> Motion:
    bends = rng.uniform() < 0.4
    speed = float(rng.uniform(1.8, 2.6) if bends else rng.uniform(2.1, 3.5))
    radius = float(rng.uniform(1.6, 4.0) * rng.choice([-1.0, 1.0])) if bends else None
    return run(person, gait_of(person, speed, seed), float(rng.uniform(6.0, 8.0)), radius)


def _mixture(person: Person, rng: np.random.Generator) -> list[Motion]:
    """Every everyday movement twice, half of the postures, some steps, in random order."""
    motions = [everyday(person, name, int(rng.integers(2**31))) for name in (*EVERYDAY, *EVERYDAY)]
    names = rng.permutation(np.array(POSTURES))[: len(POSTURES) // 2]
    motions += [posture(person, str(name), int(rng.integers(2**31))) for name in names]
    motions += [_walk(person, rng) for _ in range(2)]
    return [motions[k] for k in rng.permutation(len(motions))]
