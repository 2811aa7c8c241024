"""Headings of cameras, and which two of them are most like the paper's orthogonal pair."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from common.camera.pinhole import Camera

SAME_DEG = 2.0  # pairs this close to each other are equally orthogonal; the better front view decides


@dataclass(frozen=True)
class Attitude:
    """heading_deg: from -Z (the paper's camera 1) towards +X.  tilt_deg: up is positive.  roll_deg: clockwise image."""

    heading_deg: float
    tilt_deg: float
    roll_deg: float


def attitude(camera: Camera) -> Attitude:
    """How the camera stands, degrees; the heading of one that looks straight up or down is 0."""
    right, down, forward = camera.rotation
    heading = np.arctan2(forward[0], -forward[2])
    tilt = np.arctan2(forward[1], np.hypot(forward[0], forward[2]))
    roll = np.arctan2(right[1], -down[1])
    return Attitude(*(float(np.degrees(angle)) for angle in (heading, tilt, roll)))


def angle_between_deg(one: Camera, other: Camera) -> float:
    """Angle of the horizontal headings, from 0 to 180 degrees."""
    difference = abs(attitude(one).heading_deg - attitude(other).heading_deg) % 360.0
    return min(difference, 360.0 - difference)


def most_orthogonal_pair(cameras: dict[str, Camera]) -> tuple[str, str]:
    """The two cameras whose headings are nearest to 90 degrees apart, the front view (nearest to -Z) first.

    Of pairs within 2 degrees of the best, the one with the camera nearest to the front view; then the first by order.
    Raises ValueError with fewer than two cameras.
    """
    if len(cameras) < 2:
        raise ValueError(f"two cameras are needed for a pair; there are: {', '.join(cameras) or 'none'}")
    off = {pair: abs(90.0 - angle_between_deg(*(cameras[name] for name in pair))) for pair in combinations(cameras, 2)}
    best = min(off.values())
    front = {name: abs(attitude(camera).heading_deg) for name, camera in cameras.items()}
    candidates = [pair for pair in off if off[pair] <= best + SAME_DEG]
    pair = min(candidates, key=lambda names: min(round(front[name], 6) for name in names))
    first, second = sorted(pair, key=lambda name: round(front[name], 6))
    return first, second
