"""Joint angles of takes, BVH, TRC and .mot files are those of the poses that were written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.angle_cases import take_of, walking_person
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.clinical_angles import clinical_angles, joint_rotations
from zenocap.common.errors import UserError
from zenocap.common.formats.angle_series import AngleSeries, angle_series, has_rigid_trunk, read_source, segment_rotations
from zenocap.common.formats.bvh_reader import read_bvh
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.mot import write_mot
from zenocap.common.formats.opensim_coordinates import coordinates_of
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import Axes
from zenocap.common.formats.trc import write_trc

BOTH = (TEN_PARTS, FOURTEEN_PARTS)
CLOSE_DEG = 0.3  # axial rotations from joint centres are smoothed over time; all others agree to 0.01


def read(path: Path) -> AngleSeries:
    source = read_source(path)
    return angle_series(source, path, rigid_trunk=has_rigid_trunk(source))


def expected(track: PoseTrack) -> dict[str, Floats]:
    return clinical_angles(joint_rotations(track.anatomy, track.angles))


def assert_equal_angles(found: AngleSeries, angles: dict[str, Floats]) -> None:
    """Wherever both are defined, and in most rows both are."""
    for name, values in angles.items():
        both = np.isfinite(values) & np.isfinite(found.angles[name])
        np.testing.assert_allclose(found.angles[name][both], values[both], atol=CLOSE_DEG, err_msg=name)
        assert np.count_nonzero(both) >= np.count_nonzero(np.isfinite(values)) - 2, name


@pytest.mark.parametrize("anatomy", BOTH, ids=lambda a: a.name)
def test_a_take_has_the_angles_of_its_poses(tmp_path: Path, anatomy: Anatomy) -> None:
    track = walking_person(anatomy, 12, lost=(3, 4))
    found = read(take_of(tmp_path / "a.mcap", track))
    assert_equal_angles(found, expected(track))
    assert found.known.tolist() == [row not in (3, 4) for row in range(12)]
    assert found.rate == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("anatomy", "axes"),
    [(FOURTEEN_PARTS, "y-up"), (FOURTEEN_PARTS, "z-up"), (FOURTEEN_PARTS, "unity"), (TEN_PARTS, "y-up")],
    ids=lambda value: getattr(value, "name", value),
)
def test_a_bvh_file_has_the_angles_of_its_poses(tmp_path: Path, anatomy: Anatomy, axes: Axes) -> None:
    track = walking_person(anatomy)
    write_bvh(tmp_path / "a.bvh", track, axes=axes)
    found = angle_series(read_source(tmp_path / "a.bvh"), tmp_path / "a.bvh", rigid_trunk=anatomy is TEN_PARTS)
    assert_equal_angles(found, expected(track))


def test_joint_centres_have_the_angles_of_a_trunk_of_one_part(tmp_path: Path) -> None:
    track = walking_person(TEN_PARTS, lost=(7,))
    write_trc(tmp_path / "a.trc", track.trajectories())
    found = read(tmp_path / "a.trc")
    assert_equal_angles(found, expected(track))
    assert found.known.tolist() == track.known.tolist()


def test_a_mot_file_has_the_angles_of_its_poses_and_frames_by_time(tmp_path: Path) -> None:
    track = walking_person(FOURTEEN_PARTS, 12, lost=(5,))
    write_mot(tmp_path / "a.mot", *coordinates_of(track))
    found = read(tmp_path / "a.mot")
    rows = np.flatnonzero(track.known)
    assert found.frames.tolist() == rows.tolist()
    assert_equal_angles(found, {name: values[rows] for name, values in expected(track).items()})


def test_joint_centres_without_head_have_no_angles_of_the_neck(tmp_path: Path) -> None:
    data = walking_person(TEN_PARTS, 5).trajectories()
    kept = [k for k, name in enumerate(data.names) if name != "Head"]
    write_trc(tmp_path / "a.trc", replace(data, names=tuple(data.names[k] for k in kept), points=data.points[:, kept]))
    assert not {"neck_flexion", "neck_bending"} & set(read(tmp_path / "a.trc").angles)


def test_missing_markers_and_unknown_suffixes_are_errors(tmp_path: Path) -> None:
    data = walking_person(TEN_PARTS, 5).trajectories()
    write_trc(tmp_path / "a.trc", replace(data, names=("X", *data.names[1:-1], "Y")))
    with pytest.raises(UserError, match=r"a\.trc: no marker LWrist; there are: X, "):
        read(tmp_path / "a.trc")
    data.points[:, data.names.index("LKnee")] = np.nan
    write_trc(tmp_path / "b.trc", data)
    with pytest.raises(UserError, match=r"b\.trc: joint centres LKnee: in no frame"):
        read(tmp_path / "b.trc")
    with pytest.raises(UserError, match=r"a\.csv: suffix '\.csv': allowed: \.mot, \.bvh, \.trc, \.c3d, \.mcap"):
        read_source(tmp_path / "a.csv")


def test_a_rest_pose_that_is_not_upright_is_noted_and_gives_no_orientations(tmp_path: Path) -> None:
    """The same motion with a rest pose that lies on its back: all OFFSETs and the root's rotation turned about X."""
    track = walking_person(FOURTEEN_PARTS)
    write_bvh(tmp_path / "a.bvh", track)
    upright = read_bvh(tmp_path / "a.bvh")
    back = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    lying = replace(upright, rotations=upright.rotations @ back)
    assert set(segment_rotations(upright, tmp_path)) == {"pelvis", "trunk", "head", "right_foot", "left_foot"}
    assert segment_rotations(lying, tmp_path) == {}
    source = read_source(tmp_path / "a.bvh")
    found = angle_series(replace(source, segments={}), tmp_path / "a.bvh", rigid_trunk=False)  # type: ignore[type-var]  # BVH
    assert found.notes == ("the rest pose of a.bvh is not upright: pelvis, trunk, head and feet are from joint centres",)
    difference = found.angles["hip_flexion_r"] - expected(track)["hip_flexion_r"]
    assert difference.std() < CLOSE_DEG  # the pelvis is another, by a constant
    np.testing.assert_allclose(found.angles["knee_flexion_l"], expected(track)["knee_flexion_l"], atol=CLOSE_DEG)


def test_joints_without_known_names_are_taken_by_the_structure(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", walking_person(TEN_PARTS, 5))
    text = (tmp_path / "a.bvh").read_text().replace("LeftLeg", "Bone17")
    (tmp_path / "b.bvh").write_text(text)
    paths = tmp_path / "a.bvh", tmp_path / "b.bvh"
    named, unnamed = (angle_series(read_source(path), path, rigid_trunk=False) for path in paths)
    # Not equal: the structure does not take the end of a foot in line with the shank for a toe.
    np.testing.assert_allclose(named.angles["knee_flexion_l"], unnamed.angles["knee_flexion_l"], atol=1e-4)
