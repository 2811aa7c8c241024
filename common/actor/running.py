"""Running: a foot on the ground, none, the other; elbows bent, the body leaning into it."""

import numpy as np

from common.actor.gait import Gait, move
from common.actor.person import Person
from common.actor.pose import Motion

SLOWEST, FASTEST = 1.5, 3.6  # metres per second


def running_gait(person: Person, speed: float, seed: int) -> Gait:
    """How a person runs at a speed in metres per second, 1.5 to 3.6.  Raises ValueError.

    seed: 0 or more, this time; the person's own manner stays.
    """
    if not SLOWEST <= speed <= FASTEST:
        raise ValueError(f"speed = {speed}: allowed: {SLOWEST} to {FASTEST} m/s")
    rng = np.random.default_rng([0x31, person.seed, seed])
    manner, leg = person.manner, person.lengths.thigh + person.lengths.shank
    fast = (speed - 2.0) / 1.5
    return Gait(
        speed=speed,
        step_s=float((0.365 - 0.02 * fast) * np.sqrt(leg / 0.86) / manner.tempo**0.5 * rng.uniform(0.97, 1.03)),
        contact=float(0.385 - 0.055 * fast + rng.uniform(-0.015, 0.015)),
        ahead=float(rng.uniform(0.27, 0.33)),
        lift=float(leg * (0.28 + 0.11 * fast) * manner.vigour * rng.uniform(0.90, 1.08)),
        heel=float(rng.uniform(0.70, 0.90)),
        rolls=0.40,
        back=0.12,
        drop=float(leg * rng.uniform(0.040, 0.055)),
        bounce=float(leg * rng.uniform(0.028, 0.038)),
        hips=float(rng.uniform(0.05, 0.12)),
        chest=float(rng.uniform(0.10, 0.20)),
        lean=float(0.06 + 0.045 * speed + rng.normal(0.0, 0.03)),
        swing=float(np.radians(24.0 + 9.0 * fast) * manner.vigour * rng.uniform(0.85, 1.15)),
        arms=float(np.radians(rng.uniform(-20.0, -8.0))),
        elbow=float(np.radians(rng.uniform(78.0, 108.0))),
        fold=float(rng.uniform(0.05, 0.32)),
        inward=float(rng.uniform(0.15, 0.45)),
    )


def run(person: Person, speed: float, seed: int, duration_s: float, radius: float | None = None) -> Motion:
    """See `running_gait` and `move`."""
    return move(person, running_gait(person, speed, seed), duration_s, radius)
