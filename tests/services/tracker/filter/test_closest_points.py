"""Printed distance D of a pose: md, truncation, part.  [Hybrid Eq. 30, 31]"""

import numpy as np
import pytest

from tests.support.tracker_scenes import NO_RAYS, average_model, frames_of, in_t_pose, rays_alone
from zenocap.common.arrays import Floats, Floats32
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.tracker.filter import closest_points
from zenocap.services.tracker.parameters import NORMAL_MODULATION

MODEL = average_model(TEN_PARTS)
T_POSE = in_t_pose(TEN_PARTS, [0.1, 0.9, -0.2])  # arms far from the other parts, legs parallel
ARM = TEN_PARTS.index["right_lower_arm"]
LIMIT = 0.15
ROUND = closest_points.Correspondence(closest=True, flat=False)


def ray_through(point: Floats, normal: Floats) -> Floats:
    """(11,) ray whose surviving interval of 0.2 m has its middle at a point."""
    across = np.cross(normal, [0.3, 0.5, 0.8])
    direction = across / np.linalg.norm(across)
    return np.concatenate([point - 2.0 * direction, direction, normal, [1.9, 2.1]])


def arm_scene() -> Floats32:
    """Four points beside the middle of a forearm in the T-pose.

    20 mm outside with the surface's normal, 20 mm outside with the opposite one, 10 mm inside with a perpendicular one,
    and 400 mm outside with the surface's normal.
    """
    frame = frames_of(MODEL, T_POSE)[ARM]
    middle = frame[:, 3] + frame[:, 1] * 0.5 * MODEL.lengths[ARM]
    out, along = frame[:, 0], frame[:, 1]
    taper = 0.5 * (MODEL.radii[ARM, 0] + MODEL.radii[ARM, 2])
    cases = [(0.02, out), (0.02, -out), (-0.01, along), (0.4, out)]
    return np.array([ray_through(middle + (taper + away) * out, normal) for away, normal in cases], np.float32).T.copy()


def test_printed_distance_of_four_points_beside_an_arm() -> None:
    """By hand, epsilon = 0.5: md = 0.5, 1.5, 1; the fourth is truncated."""
    assert NORMAL_MODULATION == 0.5
    frames, rays = frames_of(MODEL, T_POSE), arm_scene()
    expected = (0.5 * 0.02) ** 2 + (1.5 * 0.02) ** 2 + 0.01**2
    three = closest_points.mean_modulated_square(MODEL, frames, rays[:, :3].copy(), LIMIT, ROUND)
    assert three == pytest.approx(expected / 3, rel=1e-3)
    four = closest_points.mean_modulated_square(MODEL, frames, rays, LIMIT, ROUND)
    assert four == pytest.approx((expected + min(0.5 * 0.4, LIMIT) ** 2) / 4, rel=1e-3)
    assert closest_points.modulated_misfit(MODEL, rays_alone(rays), LIMIT, ROUND, T_POSE) == pytest.approx(four)


def test_a_scene_without_points_has_no_distance() -> None:
    assert closest_points.modulated_misfit(MODEL, rays_alone(NO_RAYS), LIMIT, ROUND, T_POSE) == 0.0


def test_the_corresponding_part_is_the_closest_or_the_one_with_the_matching_normal() -> None:
    """A point between both upper legs: nearer to the right one, whose surface faces the other way."""
    frames = frames_of(MODEL, T_POSE)
    right, left = TEN_PARTS.index["right_upper_leg"], TEN_PARTS.index["left_upper_leg"]
    between = frames[left, :, 3] - frames[right, :, 3]
    gap = float(np.linalg.norm(between))
    inward = between / gap  # from the right leg to the left one
    down = frames[right, :, 1] * 0.5 * MODEL.lengths[right]
    point = frames[right, :, 3] + down + 0.49 * between
    capsules = np.empty((len(frames), 5))
    closest_points.part_capsules(MODEL, frames, False, capsules)
    found, best = np.empty(closest_points.CLOSEST_LENGTH), np.empty(closest_points.CLOSEST_LENGTH)

    def parts_of(closest: bool) -> set[int]:
        """Of every part that may be tried first."""
        by = closest_points.Correspondence(closest, flat=False)
        return {
            int(closest_points.corresponding_part(MODEL, frames, capsules, by, likely, point, -inward, found, best))
            for likely in range(len(frames))
        }

    assert parts_of(True) == {right}
    assert parts_of(False) == {left}
