"""The skeleton matches the anatomy: bones join the joint centres in every pose, for both bodies."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.common.formats.test_bvh_writer import JOINTS, read_by_bvhio
from tests.support.angle_cases import walking_person
from tests.support.pose_tracks import NAMES, body
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.skeleton import BONES, Skeleton, bone_rotations, skeleton_of
from zenocap.common.formats.trajectories import PER_METRE
from zenocap.services.tracker.body.average_body import body_of_height

BODIES: dict[str, tuple[Anatomy, Bdp]] = {
    "ten": (TEN_PARTS, body()), "fourteen": (FOURTEEN_PARTS, body_of_height(1.75)),
}  # fmt: skip
MARKERS = {ours: theirs for ours, theirs in JOINTS.items() if ours != "Hip"}
CLOSE_M = 1e-9


def track_of(name: str, position: Floats, shares: Floats) -> PoseTrack:
    """A track of one row, joint angles at fractions of their ranges."""
    anatomy, bdp = BODIES[name]
    low, high = anatomy.limits.T
    angles = low + np.resize(shares, len(low)) * (high - low)
    return PoseTrack(anatomy, bdp, np.array([0]), np.array([0.0]), position[None], angles[None], {}, {}, ("",), 30.0)


def places(skeleton: Skeleton, track: PoseTrack) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Start of every bone, and end of those without child, as a BVH reader computes them."""
    turns = bone_rotations(skeleton, track)[0]
    world: list[tuple[Floats, Floats]] = []
    for k, parent in enumerate(skeleton.parents):
        if parent < 0:
            world.append((track.positions[0], turns[k]))
        else:
            origin, turn = world[parent]
            world.append((origin + turn @ skeleton.offsets[k], turn @ turns[k]))
    begins = {name: world[k][0] for k, name in enumerate(skeleton.names)}
    ends = {skeleton.names[k]: world[k][0] + world[k][1] @ offset for k, offset in skeleton.ends.items()}
    return begins, ends


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
@given(arrays(np.float64, 25, elements=st.floats(0, 1)), arrays(np.float64, 3, elements=st.floats(-2, 2)))
@settings(deadline=None, max_examples=50)
def test_bones_begin_at_joints_and_end_at_part_ends(name: str, shares: Floats, position: Floats) -> None:
    track = track_of(name, position, shares)
    anatomy, bdp = track.anatomy, track.bdp
    begins, ends = places(skeleton_of(anatomy, bdp), track)
    centres = joint_centres(anatomy, bdp, track.pose(0))
    markers = {marker.name: centres[k] for k, marker in enumerate(anatomy.markers)}
    for ours, theirs in MARKERS.items():
        np.testing.assert_allclose(begins[theirs], markers[ours], atol=CLOSE_M)
    np.testing.assert_allclose(ends["Head"], markers["Head"], atol=CLOSE_M)
    np.testing.assert_allclose(begins["Hips"], position, atol=CLOSE_M)


def test_spine_and_feet_rotate_with_fourteen_parts() -> None:
    anatomy, bdp = BODIES["fourteen"]
    track = track_of("fourteen", np.array([0.0, 0.9, 0.0]), np.linspace(0.2, 0.7, 25))
    begins, ends = places(skeleton_of(anatomy, bdp), track)
    frames = part_frames(anatomy, bdp, track.pose(0))
    np.testing.assert_allclose(begins["Spine"], frames[anatomy.index["waist"], :, 3], atol=CLOSE_M)
    np.testing.assert_allclose(begins["Neck"], frames[anatomy.index["neck_base"], :, 3], atol=CLOSE_M)
    foot = anatomy.index["left_foot"]
    tip = bdp.bases[foot] + [0.0, bdp.sizes[foot, 0], 0.0]
    np.testing.assert_allclose(ends["LeftFoot"], frames[foot] @ [*tip, 1.0], atol=CLOSE_M)


@pytest.mark.parametrize("name", BODIES)
def test_bone_rotations_of_the_rest_pose_are_identities(name: str) -> None:
    anatomy, bdp = BODIES[name]
    skeleton = skeleton_of(anatomy, bdp)
    begins = np.cumsum(skeleton.offsets[:2], axis=0)
    assert begins[-1][1] > 0, "the spine points up"
    assert skeleton.names == tuple(bone.name for bone in BONES[anatomy.name])
    assert all(parent < k for k, parent in enumerate(skeleton.parents))
    np.testing.assert_array_equal(skeleton.offsets[0], 0.0)


def test_both_bodies_have_the_same_names_for_retargeting() -> None:
    ten, fourteen = ({(bone.name, bone.parent) for bone in bones} for bones in BONES.values())
    assert ten == fourteen


def test_an_anatomy_without_a_skeleton_is_refused() -> None:
    other = Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers, TEN_PARTS.circular)
    with pytest.raises(ValueError, match="'eleven-parts' has no skeleton: allowed: ten-parts, fourteen-parts"):
        skeleton_of(other, body())


def test_a_bvh_of_fourteen_parts_is_written(tmp_path: Path) -> None:
    track = walking_person(FOURTEEN_PARTS, 3)
    write_bvh(tmp_path / "a.bvh", track)
    found, expected = read_by_bvhio(tmp_path / "a.bvh") / PER_METRE["cm"], track.trajectories()
    for name in MARKERS:
        centres = expected.points[:, expected.names.index(name)]
        np.testing.assert_allclose(found[:, NAMES.index(name)], centres, atol=1e-4, err_msg=name)
