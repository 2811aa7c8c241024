"""The scene's cylinders equal the model's parts: ends, outline, colours."""

import foxglove.messages as fox
import numpy as np
import pytest
from google.protobuf.message import Message
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from tests.support.built_messages import built
from tests.support.foxglove_reader import parsed, turn, xyz
from tests.support.two_view_scene import ANGLES, BDP, NAVEL
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import end_ellipses, part_frames
from zenocap.common.body.rotations import matrix_to_quaternion
from zenocap.common.formats.foxglove.channels import FIXED, SCENE
from zenocap.common.formats.foxglove.scene import Figure, body_transforms, deletion, fixed_transforms, placed, timestamp
from zenocap.common.messages import CameraInfo
from zenocap.services.tracker.body.average_body import body_of_height

FIGURE = Figure(TEN_PARTS, BDP)


def scene(angles: Floats, lost: list[str]) -> Message:
    part_to_world = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles))
    return parsed(SCENE.channel(rig="r"), FIGURE.shown(part_to_world, lost, timestamp(1_500_000_000)).encode())


def ends(cylinder: Message, count: int) -> Floats:
    """(2 count, 3) points on both end ellipses, as Foxglove defines the primitive: about Z, centred, in its box."""
    around = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1) / 2
    bottom = ring * [cylinder.bottom_scale, cylinder.bottom_scale, 1] + [0, 0, -0.5]
    top = ring * [cylinder.top_scale, cylinder.top_scale, 1] + [0, 0, 0.5]
    points: Floats = np.concatenate([bottom, top]) * xyz(cylinder.size)
    return points @ turn(cylinder.pose.orientation).T + xyz(cylinder.pose.position)


@pytest.mark.slow
@given(ANGLES)
def test_cylinders_equal_their_parts(angles: Floats) -> None:
    (person,) = scene(angles, []).entities
    assert (person.frame_id, person.id) == ("world", "person")
    assert len(person.cylinders) == len(TEN_PARTS.parts)
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles))
    for cylinder, frame, size in zip(person.cylinders, frames, BDP.sizes, strict=True):
        found, expected = ends(cylinder, 8), end_ellipses(frame, size, 8)
        distances = np.linalg.norm(found[:, None] - expected[None], axis=2)
        # The primitive's Y is the part's -Z, so the ring runs in the opposite direction: equal points in another order.
        assert distances.min(axis=1).max() < 1e-9
        assert distances.min(axis=0).max() < 1e-9


def test_left_right_and_middle_differ_in_colour() -> None:
    (person,) = scene(TEN_PARTS.neutral, []).entities
    colours = {part: c.color.SerializeToString() for part, c in zip(TEN_PARTS.parts, person.cylinders, strict=True)}
    assert colours["left_upper_arm"] == colours["left_lower_leg"]
    assert colours["right_upper_arm"] == colours["right_lower_leg"]
    assert colours["torso"] == colours["head"]
    assert len(set(colours.values())) == 3
    assert {cylinder.color.a for cylinder in person.cylinders} == {1.0}


def test_a_lost_limb_is_grey() -> None:
    (person,) = scene(TEN_PARTS.neutral, ["right_arm"]).entities
    grey = {part for part, c in zip(TEN_PARTS.parts, person.cylinders, strict=True) if c.color.r == c.color.g == c.color.b}
    assert grey == {"right_upper_arm", "right_lower_arm"}


def test_the_figure_expires_without_further_messages() -> None:
    (person,) = scene(TEN_PARTS.neutral, []).entities
    assert (person.lifetime.seconds, person.lifetime.nanos) == (1, 0)
    assert (person.timestamp.seconds, person.timestamp.nanos) == (1, 500_000_000)


def test_a_lost_person_is_deleted() -> None:
    update = parsed(SCENE.channel(rig="r"), deletion(timestamp(7)).encode())
    (deleted,) = update.deletions
    assert (deleted.id, deleted.type, deleted.timestamp.nanos) == ("person", 0, 7)
    assert len(update.entities) == 0


def test_a_tapered_part_is_a_cone_of_its_height_between_its_ends() -> None:
    """Both radii shrink by their mean factor, so either end's area is about the part's."""
    bdp = body_of_height(1.75)
    frames = part_frames(FOURTEEN_PARTS, bdp, Pose(NAVEL, FOURTEEN_PARTS.neutral))
    shown = Figure(FOURTEEN_PARTS, bdp).shown(frames, [], timestamp(1))
    (person,) = parsed(SCENE.channel(rig="r"), shown.encode()).entities
    for k, (cylinder, frame) in enumerate(zip(person.cylinders, frames, strict=True)):
        near, far = np.split(ends(cylinder, 8), 2)
        begin, end = bdp.bases[k], bdp.bases[k] + [0.0, bdp.sizes[k, 0], 0.0]
        np.testing.assert_allclose(near.mean(axis=0), frame @ [*begin, 1.0], atol=1e-9)
        np.testing.assert_allclose(far.mean(axis=0), frame @ [*end, 1.0], atol=1e-9)
        assert max(cylinder.bottom_scale, cylinder.top_scale) == 1.0
        radius, radii = np.linalg.norm(near - near.mean(axis=0), axis=1), bdp.sizes[k, 1:]
        np.testing.assert_allclose([radius.max(), radius.min()], [radii.max(), radii.min()], rtol=1e-9)
        assert cylinder.top_scale / cylinder.bottom_scale == pytest.approx(np.mean(bdp.tips[k] / radii), rel=1e-9)


UNIT = arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1)
POSITIONS = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


def read_back(transforms: list[fox.FrameTransform]) -> list[Message]:
    return list(parsed(FIXED.channel(rig="r"), fox.FrameTransforms(transforms=transforms).encode()).transforms)


@given(UNIT)
@example(np.array([1.0, 0.0, 0.0, 0.0]))  # half turns
@example(np.array([0.0, 1.0, 0.0, 0.0]))
@example(np.array([0.0, 0.0, 1.0, 0.0]))
def test_quaternions_equal_their_rotations(q: Floats) -> None:
    rotation = Rotation.from_quat(q).as_matrix()
    found = matrix_to_quaternion(rotation[None])[0]
    np.testing.assert_allclose(Rotation.from_quat(found).as_matrix(), rotation, atol=1e-12)
    assert abs(np.linalg.norm(found) - 1) < 1e-12


@pytest.mark.slow
@given(ANGLES, POSITIONS)
def test_composed_transforms_equal_the_kinematics(angles: Floats, position: Floats) -> None:
    part_to_world = part_frames(TEN_PARTS, BDP, Pose(position, angles))
    placed = {"world": np.eye(4)}
    for transform in read_back(body_transforms(TEN_PARTS, BDP.offsets, part_to_world, timestamp(5))):
        child_to_parent = np.eye(4)
        child_to_parent[:3, :3], child_to_parent[:3, 3] = turn(transform.rotation), xyz(transform.translation)
        placed[transform.child_frame_id] = placed[transform.parent_frame_id] @ child_to_parent
    for part, expected in zip(TEN_PARTS.parts, part_to_world, strict=True):
        np.testing.assert_allclose(placed[part][:3], expected, atol=1e-9)


def test_the_world_is_upright_in_the_root_frame() -> None:
    (world,) = read_back(fixed_transforms([], timestamp(0)))
    assert (world.parent_frame_id, world.child_frame_id) == ("map", "world")
    np.testing.assert_allclose(turn(world.rotation), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    np.testing.assert_array_equal(xyz(world.translation), 0)


@given(UNIT, POSITIONS)
def test_a_cameras_frame_agrees_with_its_projection(q: Floats, translation: Floats) -> None:
    """x_camera = R x_world + t, so the frame's transform takes x_camera back to x_world."""
    rotation = Rotation.from_quat(q).as_matrix()
    info = built(CameraInfo, viewer="7", rotation=rotation.ravel().tolist(), translation=translation.tolist())
    camera = read_back(fixed_transforms([placed(info)], timestamp(0)))[1]
    assert (camera.parent_frame_id, camera.child_frame_id) == ("world", "viewer/7")
    point = np.array([0.3, -1.2, 2.0])
    seen = rotation @ point + translation
    np.testing.assert_allclose(turn(camera.rotation) @ seen + xyz(camera.translation), point, atol=1e-9)
