"""Gait parameters of walking and running at a given speed."""

import numpy as np

from zenocap.simulation.body.person import Person
from zenocap.simulation.body.pose import Motion
from zenocap.simulation.motion.gait import Gait, gait_motion

WALKING_SPEEDS, RUNNING_SPEEDS = (0.6, 1.9), (1.5, 3.6)  # slowest and fastest, m/s; chosen by hand


def walking_gait(person: Person, speed: float, seed: int) -> Gait:
    """Walking gait of a person at `speed` (0.6 to 1.9 m/s).  Raises ValueError.

    seed: 0 or more, variation of this walk around the person's manner.
    """
    _check_speed(speed, WALKING_SPEEDS)
    rng = np.random.default_rng([0x36, person.seed, seed])
    manner, leg = person.manner, person.lengths.thigh + person.lengths.shank
    fast = (speed - 1.3) / 0.6
    # A change of speed changes step length and step rate by about the same factor.
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


def continuous_walk(person: Person, speed: float, seed: int, duration_s: float, radius: float | None = None) -> Motion:
    """Walk without stopping at each step; see `walking_gait` and `gait_motion`."""
    return gait_motion(person, walking_gait(person, speed, seed), duration_s, radius)


def running_gait(person: Person, speed: float, seed: int) -> Gait:
    """Running gait of a person at `speed` (1.5 to 3.6 m/s).  Raises ValueError.

    seed: 0 or more, variation of this run around the person's manner.
    """
    _check_speed(speed, RUNNING_SPEEDS)
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
    """Run; see `running_gait` and `gait_motion`."""
    return gait_motion(person, running_gait(person, speed, seed), duration_s, radius)


def _check_speed(speed: float, limits: tuple[float, float]) -> None:
    low, high = limits
    if not low <= speed <= high:
        raise ValueError(f"speed = {speed}: allowed: {low} to {high} m/s")
