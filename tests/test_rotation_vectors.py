"""Rotation vectors: against scipy's, there and back, and at the ends of their range."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from common.body.anatomy import Floats
from common.body.rotation_vectors import rotation_of, vector_of

components = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


def matrix(vector: Floats) -> Floats:
    out = np.empty((3, 3))
    rotation_of(vector, out)
    return out


def vector(rotation: Floats) -> Floats:
    out = np.empty(3)
    vector_of(rotation, out)
    return out


@given(components, st.floats(0.0, 20.0))
def test_a_vector_becomes_the_rotation_that_scipy_has(direction: tuple[float, float, float], size: float) -> None:
    turned = size * np.array(direction)
    assert matrix(turned) == pytest.approx(Rotation.from_rotvec(turned).as_matrix(), abs=1e-12)


@given(components, st.floats(1e-12, 1.0))
def test_up_to_half_a_turn_the_vector_comes_back(direction: tuple[float, float, float], share: float) -> None:
    axis = np.array(direction) + np.array([1e-6, 0.0, 0.0])
    turned = 0.999 * np.pi * share * axis / max(float(np.linalg.norm(axis)), 1e-3)
    assert vector(matrix(turned)) == pytest.approx(turned, abs=1e-9)


@given(components)
def test_a_rotation_comes_back_from_any_vector(direction: tuple[float, float, float]) -> None:
    rotation = matrix(10.0 * np.array(direction))
    found = vector(rotation)
    assert np.linalg.norm(found) <= np.pi + 1e-9
    assert matrix(found) == pytest.approx(rotation, abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_a_turn_about_any_axis_has_its_vector(axis: int) -> None:
    whole = np.pi * np.eye(3)[axis]
    assert np.abs(vector(matrix(whole))) == pytest.approx(whole, abs=1e-7)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-9, 3e-8, 1e-7, 1e-5])
def test_small_turns_keep_all_their_digits(size: float) -> None:
    small = size * np.array([0.6, 0.0, -0.8])
    assert vector(matrix(small)) == pytest.approx(small, rel=1e-9, abs=1e-20)
