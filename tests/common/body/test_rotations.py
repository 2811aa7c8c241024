"""Conversions of rotations: scipy, round trips, gimbal lock, half turns, small angles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from zenocap.common.arrays import Floats
from zenocap.common.body.rotations import (
    euler_to_matrix,
    matrix_to_euler,
    matrix_to_vector,
    shortest_rotation,
    unit,
    vector_to_matrix,
)

ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")
special = st.one_of(st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi]), st.floats(-7, 7))
triples = st.tuples(special, special, special).map(lambda angles: np.array([angles]))


@given(axes=st.sampled_from(ORDERS), angles=triples)
def test_euler_to_matrix_equals_scipy(axes: str, angles: Floats) -> None:
    expected = Rotation.from_euler(axes.upper(), angles).as_matrix()
    np.testing.assert_allclose(euler_to_matrix(axes, angles), expected, atol=1e-12)


@pytest.mark.slow
@given(axes=st.sampled_from(ORDERS), angles=triples, near=triples)
def test_matrix_to_euler_returns_the_nearest_angles_of_the_rotation(axes: str, angles: Floats, near: Floats) -> None:
    rotation = euler_to_matrix(axes, angles)
    found = matrix_to_euler(axes, rotation, near)
    np.testing.assert_allclose(euler_to_matrix(axes, found), rotation, atol=2e-6)
    a, b, c = angles[0]
    if abs(np.cos(b)) > 1e-3:
        np.testing.assert_allclose(matrix_to_euler(axes, rotation, angles), angles, atol=1e-9)
        for one in np.array([(a, b, c), (a + np.pi, np.pi - b, c + np.pi)]):
            one += 2 * np.pi * np.round((near[0] - one) / (2 * np.pi))
            assert np.abs(found - near).sum() <= np.abs(one - near[0]).sum() + 1e-6


@pytest.mark.parametrize("axes", ORDERS)
def test_in_gimbal_lock_the_first_angle_is_kept(axes: str) -> None:
    near = np.array([[0.3, 1.5, -0.2]])
    found = matrix_to_euler(axes, euler_to_matrix(axes, np.array([[0.7, np.pi / 2, 0.1]])), near)
    assert found[0, 0] == 0.3
    assert found[0, 1] == pytest.approx(np.pi / 2)


components = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def matrix(vector: Floats) -> Floats:
    out = np.empty((3, 3))
    vector_to_matrix(vector, out)
    return out


def vector(rotation: Floats) -> Floats:
    out = np.empty(3)
    matrix_to_vector(rotation, out)
    return out


@given(components, st.floats(0.0, 20.0))
def test_vector_to_matrix_equals_scipy(direction: tuple[float, float, float], size: float) -> None:
    turned = size * np.array(direction)
    assert matrix(turned) == pytest.approx(Rotation.from_rotvec(turned).as_matrix(), abs=1e-12)


@given(components, st.floats(1e-12, 1.0))
def test_vectors_up_to_half_a_turn_round_trip(direction: tuple[float, float, float], share: float) -> None:
    axis = np.array(direction) + np.array([1e-6, 0.0, 0.0])
    turned = 0.999 * np.pi * share * axis / max(float(np.linalg.norm(axis)), 1e-3)
    assert vector(matrix(turned)) == pytest.approx(turned, abs=1e-9)


@given(components)
def test_matrices_round_trip_for_any_vector(direction: tuple[float, float, float]) -> None:
    rotation = matrix(10.0 * np.array(direction))
    found = vector(rotation)
    assert np.linalg.norm(found) <= np.pi + 1e-9
    assert matrix(found) == pytest.approx(rotation, abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_about_the_axes_round_trip(axis: int) -> None:
    whole = np.pi * np.eye(3)[axis]
    assert np.abs(vector(matrix(whole))) == pytest.approx(whole, abs=1e-7)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-9, 3e-8, 1e-7, 1e-5])
def test_small_rotations_keep_full_precision(size: float) -> None:
    small = size * np.array([0.6, 0.0, -0.8])
    assert vector(matrix(small)) == pytest.approx(small, rel=1e-9, abs=1e-20)


unit_vectors = st.integers(0, 10_000).map(lambda seed: unit(np.random.default_rng(seed).normal(size=(5, 3))))


@given(start=unit_vectors, end=unit_vectors)
def test_shortest_rotation_maps_start_to_end_by_the_angle_between_them(start: Floats, end: Floats) -> None:
    rotations = shortest_rotation(start, end)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", rotations, start), end, atol=1e-6)
    angles = np.linalg.norm(Rotation.from_matrix(rotations).as_rotvec(), axis=1)
    np.testing.assert_allclose(angles, np.arccos(np.clip(np.sum(start * end, axis=1), -1, 1)), atol=1e-5)
