"""Walking at any pace, without stopping at every step: heel to toe, one foot always on the ground."""

import numpy as np

from common.actor.gait import Gait, move
from common.actor.person import Person
from common.actor.pose import Motion

SLOWEST, FASTEST = 0.6, 1.9  # metres per second


def walking_gait(person: Person, speed: float, seed: int) -> Gait:
    """How a person walks at a speed in metres per second, 0.6 to 1.9.  Raises ValueError.

    seed: 0 or more, this time; the person's own manner stays.
    """
    if not SLOWEST <= speed <= FASTEST:
        raise ValueError(f"speed = {speed}: allowed: {SLOWEST} to {FASTEST} m/s")
    rng = np.random.default_rng([0x36, person.seed, seed])
    manner, leg = person.manner, person.lengths.thigh + person.lengths.shank
    fast = (speed - 1.3) / 0.6
    # Step length and rate share a change of speed about equally.
    step_s = 0.53 * (1.3 / speed) ** 0.45 * np.sqrt(leg / 0.86) / manner.tempo**0.5 * rng.uniform(0.96, 1.04)
    return Gait(
        speed=speed,
        step_s=float(step_s),
        contact=float(0.615 - 0.02 * fast + rng.uniform(-0.01, 0.01)),
        ahead=float(rng.uniform(0.39, 0.43)),
        lift=float(leg * (0.105 + 0.02 * fast) * manner.vigour * rng.uniform(0.8, 1.3)),
        heel=float(rng.uniform(0.80, 1.02)),
        rolls=float(rng.uniform(0.48, 0.56)),
        back=float(rng.uniform(0.05, 0.12)),
        drop=float(leg * rng.uniform(0.035, 0.058)),
        bounce=float(-leg * rng.uniform(0.008, 0.018)),
        hips=float(rng.uniform(0.05, 0.14)),
        chest=float(rng.uniform(0.05, 0.16)),
        lean=float(rng.normal(0.04, 0.05)),
        swing=float(np.radians(16.0 + 5.0 * fast) * manner.vigour * rng.uniform(0.6, 1.3)),
        arms=float(np.radians(rng.uniform(-8.0, 2.0))),
        elbow=float(np.radians(rng.uniform(14.0, 50.0))),
        fold=float(rng.uniform(0.05, 0.40)),
        inward=float(rng.uniform(0.0, 0.35)),
    )


def stride(person: Person, speed: float, seed: int, duration_s: float, radius: float | None = None) -> Motion:
    """See `walking_gait` and `move`."""
    return move(person, walking_gait(person, speed, seed), duration_s, radius)
