"""How limbs turn about themselves: seen where they bend, carried over where they do not, and never jumping."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from common.body.anatomy import Floats
from common.body.twists import CLEAR, across, hinge_axes, swing, unit

unit_vectors = st.integers(0, 10_000).map(lambda seed: unit(np.random.default_rng(seed).normal(size=(5, 3))))


@given(start=unit_vectors, end=unit_vectors)
def test_a_swing_is_the_smallest_rotation(start: Floats, end: Floats) -> None:
    rotations = swing(start, end)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", rotations, start), end, atol=1e-6)
    angles = np.linalg.norm(Rotation.from_matrix(rotations).as_rotvec(), axis=1)
    np.testing.assert_allclose(angles, np.arccos(np.clip(np.sum(start * end, axis=1), -1, 1)), atol=1e-5)


@given(seed=st.integers(0, 10_000))
def test_without_anything_seen_the_axis_is_natural(seed: int) -> None:
    direction, natural = unit(np.random.default_rng(seed).normal(size=(2, 5, 3)))
    axes = hinge_axes(direction[:1], (), natural[:1])
    np.testing.assert_allclose(axes, unit(across(natural[:1], direction[:1])), atol=1e-9)


def test_a_clear_bend_is_believed_and_a_straight_limb_follows_its_neighbours() -> None:
    count = 61
    direction = np.tile([0.0, -1.0, 0.0], (count, 1))
    turn = np.linspace(0.0, 1.0, count)
    true = np.stack([-np.cos(turn), np.zeros(count), np.sin(turn)], axis=1)
    bend = np.radians(np.abs(np.linspace(-60, 60, count)))
    noisy = true * np.sin(bend)[:, None] + np.random.default_rng(3).normal(0, 0.02, (count, 3)) * [1, 0, 1]
    axes = hinge_axes(direction, ((noisy, CLEAR**-4, 4),), np.tile([-1.0, 0.0, 0.0], (count, 1)))
    wrong = np.arccos(np.clip(np.sum(axes * true, axis=1), -1, 1))
    assert wrong.max() < np.radians(12)
    assert np.abs(np.sum(axes * direction, axis=1)).max() < 1e-9
    steps = np.arccos(np.clip(np.sum(axes[1:] * axes[:-1], axis=1), -1, 1))
    assert steps.max() < np.radians(8)
