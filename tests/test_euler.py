"""Euler angles: back and forth is the same rotation, near ones are near, in gimbal lock too."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from common.body.anatomy import Floats
from common.body.euler import angles_near, rotation

ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")
special = st.one_of(st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi]), st.floats(-7, 7))
triples = st.tuples(special, special, special).map(lambda angles: np.array([angles]))


@given(axes=st.sampled_from(ORDERS), angles=triples)
def test_rotations_are_those_of_another_library(axes: str, angles: Floats) -> None:
    expected = Rotation.from_euler(axes.upper(), angles).as_matrix()
    np.testing.assert_allclose(rotation(axes, angles), expected, atol=1e-12)


@given(axes=st.sampled_from(ORDERS), angles=triples, near=triples)
def test_the_angles_are_of_the_same_rotation(axes: str, angles: Floats, near: Floats) -> None:
    wanted = rotation(axes, angles)
    np.testing.assert_allclose(rotation(axes, angles_near(axes, wanted, near)), wanted, atol=2e-6)


@given(axes=st.sampled_from(ORDERS), angles=triples)
def test_angles_near_themselves_stay_away_from_gimbal_lock(axes: str, angles: Floats) -> None:
    if abs(np.cos(angles[0, 1])) > 1e-3:
        np.testing.assert_allclose(angles_near(axes, rotation(axes, angles), angles), angles, atol=1e-9)


@pytest.mark.parametrize("axes", ORDERS)
def test_in_gimbal_lock_the_first_angle_stays(axes: str) -> None:
    near = np.array([[0.3, 1.5, -0.2]])
    found = angles_near(axes, rotation(axes, np.array([[0.7, np.pi / 2, 0.1]])), near)
    assert found[0, 0] == 0.3
    assert found[0, 1] == pytest.approx(np.pi / 2)


@given(axes=st.sampled_from(ORDERS), angles=triples, near=triples)
def test_no_other_solution_is_nearer(axes: str, angles: Floats, near: Floats) -> None:
    found = angles_near(axes, rotation(axes, angles), near)
    if abs(np.cos(angles[0, 1])) > 1e-3:
        a, b, c = angles[0]
        for first, middle, last in ((a, b, c), (a + np.pi, np.pi - b, c + np.pi)):
            one = np.array([first, middle, last])
            one += 2 * np.pi * np.round((near[0] - one) / (2 * np.pi))
            assert np.abs(found - near).sum() <= np.abs(one - near[0]).sum() + 1e-6
