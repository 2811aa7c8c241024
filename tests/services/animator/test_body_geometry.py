"""Capsules and outlines of the virtual actor agree with the kinematics and the camera."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.animator_stand_in import body, pose_at
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import ANATOMIES, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import body_ellipses, end_ellipses, part_frames
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.rig.rig import demo_rig
from zenocap.services.animator.body_geometry import capsule_shapes, part_outlines, placed_capsules

CAMERA = demo_rig("two-view").viewers[0].camera
BODY = body_from_lengths(TEN_PARTS, average_lengths(1.8))


def turned(quaternion: Floats, *vector: float) -> Floats:
    """Hamilton product q v q*."""
    axis, w = quaternion[:3], quaternion[3]
    return vector + 2 * np.cross(axis, np.cross(axis, vector) + w * np.array(vector))


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


@pytest.mark.slow
@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(ANATOMIES)))
def test_both_ends_of_every_capsule_are_the_centres_of_the_parts_end_ellipses_and_its_radii_lie_along_its_axes(
    seed: int, name: str
) -> None:
    anatomy = ANATOMIES[name]
    body, pose = random_body(anatomy, seed), random_pose(anatomy, seed)
    shapes, placed = capsule_shapes(body), placed_capsules(anatomy, body, pose)
    for part, ellipses in enumerate(body_ellipses(body, placed.frames)):
        place, quaternion = placed.positions[part], placed.quaternions[part]
        near, far = ellipses[:24].mean(axis=0), ellipses[24:].mean(axis=0)
        np.testing.assert_allclose(place, near, atol=1e-9)
        np.testing.assert_allclose(place + turned(quaternion, 0.0, shapes.lengths[part], 0.0), far, atol=1e-9)
        np.testing.assert_allclose(place + turned(quaternion, shapes.near[part, 0], 0.0, 0.0), ellipses[0], atol=1e-9)


def test_cylinders_have_equal_radii_at_both_ends() -> None:
    shapes = capsule_shapes(BODY)
    np.testing.assert_array_equal(shapes.near, shapes.far)
    assert shapes.lengths[TEN_PARTS.index["torso"]] == pytest.approx(BODY.sizes[0, 0])


def test_every_part_is_inside_its_outline_and_touches_it() -> None:
    pose = pose_at(0.7)
    found = dict(part_outlines(TEN_PARTS, body(), pose, CAMERA))
    assert list(found) == list(TEN_PARTS.parts)
    for part, frame in zip(TEN_PARTS.parts, part_frames(TEN_PARTS, body(), pose), strict=True):
        points = CAMERA.project(end_ellipses(frame, body().sizes[TEN_PARTS.index[part]]))
        hull = found[part].astype(np.float32)
        distances = [cv2.pointPolygonTest(hull, (float(x), float(y)), True) for x, y in points]
        assert min(distances) > -0.01
        assert min(map(abs, distances)) < 0.01


def test_parts_behind_the_camera_have_no_outline() -> None:
    behind = Pose(CAMERA.centre + np.array([0.0, 0.0, 3.0]), TEN_PARTS.neutral)
    assert part_outlines(TEN_PARTS, body(), behind, CAMERA) == []
