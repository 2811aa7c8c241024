"""Training motions of one kind, about half a minute each, with variation by seed."""

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import Motion, PersonPose, Placement, compose, neutral, place
from zenocap.simulation.motion.activities import ACTIVITIES, activity
from zenocap.simulation.motion.boxing import box
from zenocap.simulation.motion.footsteps import turning_path, walk
from zenocap.simulation.motion.gait_styles import continuous_walk, run
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.postures import posture

KINDS = ("walking", "running", "boxing", "general")
BOUT_S = 24.0


def corpus_motion(person: Person, kind: str, seed: int) -> Motion:
    """About 30 s of a kind of motion, beginning standing at the origin.  Raises ValueError for a kind not in KINDS."""
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
    """Concatenate motions, each from the end of the previous one, standing still for `pause_s` seconds in between."""
    starts, places, time_s, at = [], [], 0.0, Placement()
    for motion in motions:
        starts.append(time_s)
        places.append(at)
        time_s += motion.duration_s + pause_s
        at = compose(at, motion.end)
    standing = neutral(person)

    def pose_at(time_s: float) -> PersonPose:
        k = max(int(np.searchsorted(starts, time_s, side="right")) - 1, 0)
        within_s = time_s - starts[k]
        if within_s > motions[k].duration_s:
            return place(standing, compose(places[k], motions[k].end))
        return place(motions[k].pose_at(within_s), places[k])

    return Motion(time_s, pose_at, at)


def _walk(person: Person, rng: np.random.Generator) -> Motion:
    seed, kind = int(rng.integers(2**31)), float(rng.uniform())
    if kind < 0.08:
        return walk(person, turning_path(float(rng.uniform(1.5, 3.1) * rng.choice([-1.0, 1.0])), 5), 0.5, arms=0.5)
    speed = float(rng.uniform(0.8, 1.7) if kind < 0.55 else rng.uniform(0.7, 1.3))
    radius = None if kind < 0.55 else float(rng.uniform(1.0, 3.5) * rng.choice([-1.0, 1.0]))
    return continuous_walk(person, speed, seed, float(rng.uniform(6.0, 9.0)), radius)


def _run(person: Person, rng: np.random.Generator, seed: int) -> Motion:
    bends = rng.uniform() < 0.4
    speed = float(rng.uniform(1.8, 2.6) if bends else rng.uniform(2.1, 3.5))
    radius = float(rng.uniform(1.6, 4.0) * rng.choice([-1.0, 1.0])) if bends else None
    return run(person, speed, seed, float(rng.uniform(6.0, 8.0)), radius)


def _mixture(person: Person, rng: np.random.Generator) -> list[Motion]:
    """Every everyday movement twice, half of the postures and some steps, in random order."""
    motions = [activity(person, name, int(rng.integers(2**31))) for name in (*ACTIVITIES, *ACTIVITIES)]
    names = rng.permutation(np.array(POSTURES))[: len(POSTURES) // 2]
    motions += [posture(person, str(name), int(rng.integers(2**31))) for name in names]
    motions += [_walk(person, rng) for _ in range(2)]
    return [motions[k] for k in rng.permutation(len(motions))]
