"""Rows of a motion: independent of place and heading, in their stated frames."""

import numpy as np
import pytest

from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.services.recognizer.features import features_of
from zenocap.services.recognizer.motion_rows import ANGLES, HEADING, HEIGHT, JOINTS, POINTS, TRUNK_UP, WAY, WIDTH, rows_of

ANATOMIES = [TEN_PARTS, FOURTEEN_PARTS]


def poses(anatomy: Anatomy, count: int = 6, seed: int = 0) -> np.ndarray:
    """(count, angles) around the neutral pose."""
    rng = np.random.default_rng(seed)
    return anatomy.neutral + rng.uniform(-0.4, 0.4, (count, len(anatomy.angles)))


@pytest.mark.parametrize("anatomy", ANATOMIES, ids=lambda anatomy: anatomy.name)
def test_standing_has_arms_and_legs_down_and_the_trunk_up(anatomy: Anatomy) -> None:
    (row,) = rows_of(anatomy, np.array([[0.3, 0.9, -2.0]]), anatomy.neutral[None])
    points = dict(zip(JOINTS, row[POINTS].reshape(-1, 3), strict=True))
    np.testing.assert_allclose(points["left_wrist"], [0.129, 0.288 - 0.186 - 0.146, 0.0], atol=1e-9)
    np.testing.assert_allclose(points["right_ankle"], [-0.05, -0.245 - 0.246, 0.0], atol=1e-9)
    np.testing.assert_allclose(points["head"], [0.0, 0.288 + 0.182, 0.0], atol=1e-9)
    np.testing.assert_allclose(row[TRUNK_UP], [0.0, 1.0, 0.0], atol=1e-9)
    assert row[HEIGHT] == pytest.approx(0.491)
    np.testing.assert_allclose(row[WAY], [0.3, -2.0])
    np.testing.assert_allclose(row[HEADING], [0.0, 1.0], atol=1e-9)


@pytest.mark.parametrize("anatomy", ANATOMIES, ids=lambda anatomy: anatomy.name)
def test_place_and_heading_change_only_their_own_columns(anatomy: Anatomy) -> None:
    angles, place = poses(anatomy), np.zeros((6, 3))
    turned = angles.copy()
    turned[:, anatomy.index["navel.y"]] += 1.1
    one, other = rows_of(anatomy, place, angles), rows_of(anatomy, place + np.array([2.0, 0.1, 3.0]), turned)
    np.testing.assert_allclose(one[:, : WAY.start], other[:, : WAY.start], atol=1e-9)
    np.testing.assert_allclose(other[:, WAY], np.broadcast_to([2.0, 3.0], (6, 2)))
    before, after = (np.arctan2(rows[:, HEADING][:, 0], rows[:, HEADING][:, 1]) for rows in (one, other))
    np.testing.assert_allclose(np.angle(np.exp(1j * (after - before))), 1.1, atol=1e-9)


def test_a_raised_left_arm_is_up_and_a_bent_trunk_is_forward() -> None:
    angles = TEN_PARTS.neutral.copy()
    angles[TEN_PARTS.index["left_shoulder.z"]] = 2.0 * np.pi
    angles[TEN_PARTS.index["navel.x"]] = 0.5
    (row,) = rows_of(TEN_PARTS, np.zeros((1, 3)), angles[None])
    points = dict(zip(JOINTS, row[POINTS].reshape(-1, 3), strict=True))
    assert points["left_wrist"][1] > points["head"][1] > points["right_wrist"][1]
    assert row[TRUNK_UP][2] == pytest.approx(np.sin(0.5))


@pytest.mark.parametrize("anatomy", ANATOMIES, ids=lambda anatomy: anatomy.name)
def test_the_first_columns_are_the_ten_angles_and_a_missing_pose_is_nan(anatomy: Anatomy) -> None:
    angles = poses(anatomy)
    angles[2] = np.nan
    rows = rows_of(anatomy, np.zeros((6, 3)), angles, "joint-angles")
    assert rows.shape == (6, WIDTH)
    np.testing.assert_allclose(rows[:, ANGLES], features_of(anatomy, angles, "joint-angles"))
    assert np.isnan(rows[2, : WAY.start]).all()
    assert np.isfinite(np.delete(rows, 2, axis=0)).all()
