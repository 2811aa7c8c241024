"""The cylinders are the model's parts: their ends, their outline, their colours."""

import numpy as np
from foxglove_reader import parsed, turn, xyz
from google.protobuf.message import Message
from hypothesis import given
from two_view_scene import ANGLES, BDP, NAVEL

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Floats
from common.body.definition import Pose
from common.body.kinematics import part_frames
from common.body.surface import end_ellipses
from common.formats.foxglove.body import Figure, gone
from common.formats.foxglove.channels import SCENE
from common.formats.foxglove.frames import timestamp
from services.tracker.stature import body_of_height

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


@given(ANGLES)
def test_every_cylinder_is_its_part(angles: Floats) -> None:
    (person,) = scene(angles, []).entities
    assert (person.frame_id, person.id) == ("world", "person")
    assert len(person.cylinders) == len(TEN_PARTS.parts)
    frames = part_frames(TEN_PARTS, BDP, Pose(NAVEL, angles))
    for cylinder, frame, size in zip(person.cylinders, frames, BDP.sizes, strict=True):
        found, expected = ends(cylinder, 8), end_ellipses(frame, size, 8)
        distances = np.linalg.norm(found[:, None] - expected[None], axis=2)
        # The primitive's Y is the part's -Z, so the ring runs the other way round: the same points in another order.
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


def test_a_limb_that_is_searched_for_is_grey() -> None:
    (person,) = scene(TEN_PARTS.neutral, ["right_arm"]).entities
    grey = {part for part, c in zip(TEN_PARTS.parts, person.cylinders, strict=True) if c.color.r == c.color.g == c.color.b}
    assert grey == {"right_upper_arm", "right_lower_arm"}


def test_the_person_goes_by_itself_when_nothing_follows() -> None:
    (person,) = scene(TEN_PARTS.neutral, []).entities
    assert (person.lifetime.seconds, person.lifetime.nanos) == (1, 0)
    assert (person.timestamp.seconds, person.timestamp.nanos) == (1, 500_000_000)


def test_a_lost_person_is_deleted() -> None:
    update = parsed(SCENE.channel(rig="r"), gone(timestamp(7)).encode())
    (deletion,) = update.deletions
    assert (deletion.id, deletion.type, deletion.timestamp.nanos) == ("person", 0, 7)
    assert len(update.entities) == 0


def test_a_tapered_part_is_a_cone_of_its_height_between_its_ends() -> None:
    """Its radii shrink alike: by as much as both do in the mean, so either end's area is about the part's."""
    bdp = body_of_height(1.75)
    assert bdp.tips is not None
    assert bdp.bases is not None
    frames = part_frames(FOURTEEN_PARTS, bdp, Pose(NAVEL, FOURTEEN_PARTS.neutral))
    channel = SCENE.channel(rig="r")
    shown = Figure(FOURTEEN_PARTS, bdp).shown(frames, [], timestamp(1))
    (person,) = parsed(channel, shown.encode()).entities
    for k, (cylinder, frame) in enumerate(zip(person.cylinders, frames, strict=True)):
        near, far = np.split(ends(cylinder, 8), 2)
        begin, end = bdp.bases[k], bdp.bases[k] + [0.0, bdp.sizes[k, 0], 0.0]
        np.testing.assert_allclose(near.mean(axis=0), frame @ [*begin, 1.0], atol=1e-9)
        np.testing.assert_allclose(far.mean(axis=0), frame @ [*end, 1.0], atol=1e-9)
        assert max(cylinder.bottom_scale, cylinder.top_scale) == 1.0
        radius = np.linalg.norm(near - near.mean(axis=0), axis=1)
        np.testing.assert_allclose(
            [radius.max(), radius.min()], [bdp.sizes[k, 1:].max(), bdp.sizes[k, 1:].min()], rtol=1e-9
        )
        np.testing.assert_allclose(
            cylinder.top_scale / cylinder.bottom_scale, np.mean(bdp.tips[k] / bdp.sizes[k, 1:]), rtol=1e-9
        )
