"""Shapes of the actor stand where the kinematics put the parts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from common.body.definition import Bdp, Pose
from common.body.proportions import body_from_lengths, lengths_of_height
from common.body.surface import body_ellipses
from services.animator.figure import capsules, figure

BODY = body_from_lengths(TEN_PARTS, lengths_of_height(1.8))


def turned(quaternion: Floats, vector: Floats) -> Floats:
    """Hamilton's product q v q*, written out."""
    axis, w = quaternion[:3], quaternion[3]
    turned: Floats = vector + 2 * np.cross(axis, np.cross(axis, vector) + w * vector)
    return turned


def random_pose(anatomy: Anatomy, seed: int) -> Pose:
    draw = np.random.default_rng(seed)
    low, high = anatomy.limits.T
    return Pose(draw.uniform(-1, 1, 3), draw.uniform(low, high))


def random_body(anatomy: Anatomy, seed: int) -> Bdp:
    draw = np.random.default_rng(seed)
    parts = len(anatomy.parts)
    return Bdp(
        draw.uniform(0.05, 0.5, (parts, 3)), draw.uniform(-0.3, 0.3, (parts, 3)),
        draw.uniform(0.05, 0.2, (parts, 2)), draw.uniform(-0.1, 0.1, (parts, 3)),
    )  # fmt: skip


@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(ANATOMIES)))
def test_both_ends_of_every_capsule_are_the_middles_of_the_parts_end_ellipses(seed: int, name: str) -> None:
    anatomy = ANATOMIES[name]
    body, pose = random_body(anatomy, seed), random_pose(anatomy, seed)
    shapes, placed = capsules(body), figure(anatomy, body, pose)
    for part, ellipses in enumerate(body_ellipses(body, placed.frames)):
        near, far = ellipses[:24].mean(axis=0), ellipses[24:].mean(axis=0)
        axis = turned(placed.quaternions[part], np.array([0.0, shapes.lengths[part], 0.0]))
        np.testing.assert_allclose(placed.positions[part], near, atol=1e-9)
        np.testing.assert_allclose(placed.positions[part] + axis, far, atol=1e-9)


@given(seed=st.integers(0, 10_000))
def test_a_capsules_radii_lie_along_its_own_axes(seed: int) -> None:
    body, pose = random_body(FOURTEEN_PARTS, seed), random_pose(FOURTEEN_PARTS, seed)
    shapes, placed = capsules(body), figure(FOURTEEN_PARTS, body, pose)
    for part, ellipses in enumerate(body_ellipses(body, placed.frames)):
        across = turned(placed.quaternions[part], np.array([shapes.near[part, 0], 0.0, 0.0]))
        np.testing.assert_allclose(placed.positions[part] + across, ellipses[0], atol=1e-9)


def test_cylinders_are_as_wide_at_both_ends() -> None:
    shapes = capsules(BODY)
    np.testing.assert_array_equal(shapes.near, shapes.far)
    assert shapes.lengths[TEN_PARTS.index["torso"]] == pytest.approx(BODY.sizes[0, 0])
