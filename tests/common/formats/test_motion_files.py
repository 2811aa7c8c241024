"""Poses of any motion file with their times, without rest poses and gaps."""

from pathlib import Path

import numpy as np
import pytest

from tests.common.body.test_inverse_kinematics import body
from tests.support.places import GOLDEN
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.motion_files import REST_ROWS, FileMotion, read_poses_for
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc

GOLDEN = GOLDEN / "arms.mcap"
RATE = 60.0
FIRST = 12  # frame number of the first row


def written(folder: Path, rest: int = 0, unknown: range = range(0), count: int = 90, first: int = FIRST) -> Path:
    """A left arm raised within so many frames; rest: first rows with both arms sideways.  unknown: rows."""
    points = []
    for row, share in enumerate(np.linspace(0, 1, count)):
        angles = TEN_PARTS.neutral.copy()
        angles[TEN_PARTS.index["left_shoulder.z"]] += 1.2 * share
        if row < rest:
            angles[TEN_PARTS.index["left_shoulder.z"]] = 1.5 * np.pi
            angles[TEN_PARTS.index["right_shoulder.z"]] = 0.5 * np.pi
        points.append(joint_centres(TEN_PARTS, body(TEN_PARTS), Pose(np.array([0.0, 1.0, 0.0]), angles)))
    centres = np.array(points)
    centres[unknown] = np.nan
    frames = np.arange(first, first + count, dtype=np.int64)
    names = tuple(marker.name for marker in TEN_PARTS.markers)
    write_trc(folder / "raise.trc", Trajectories(names, frames, frames / RATE, centres, RATE))
    return folder / "raise.trc"


def elbows(motion: FileMotion, anatomy: Anatomy) -> list[float]:
    return [pose.angles[anatomy.index["left_elbow.x"]] for pose in motion.poses if pose is not None]


@pytest.mark.parametrize("anatomy", [TEN_PARTS, FOURTEEN_PARTS], ids=lambda a: a.name)
def test_poses_have_the_files_times_and_rate(tmp_path: Path, anatomy: Anatomy) -> None:
    motion = read_poses_for(written(tmp_path), anatomy)
    assert (motion.name, motion.rate, len(motion.poses)) == ("raise", RATE, 90)
    np.testing.assert_allclose(motion.times_s, np.arange(FIRST, FIRST + 90) / RATE, atol=1e-6)
    assert motion.known.all()
    assert np.abs(elbows(motion, anatomy)).max() < 0.01


def test_the_rate_is_that_of_the_times_and_rows_that_are_left_out_are_gaps(tmp_path: Path) -> None:
    """What a prior and postures learn from: a DataRate of 200 had made 1.5 s of motion 0.45 s."""
    path = written(tmp_path)
    lines = path.read_text().splitlines()
    lines[2] = lines[2].replace("60\t60", "200\t200", 1)
    path.write_text("\n".join([*lines[:40], *lines[70:]]) + "\n")  # half a second of rows is missing
    motion = read_poses_for(path, TEN_PARTS)
    assert (motion.rate, len(motion.poses)) == (pytest.approx(RATE, rel=1e-3), 90)
    np.testing.assert_allclose(motion.times_s, np.arange(FIRST, FIRST + 90) / RATE, atol=1e-5)
    assert list(np.flatnonzero(~motion.known)) == list(range(34, 64))


def test_a_range_uses_the_frame_numbers_of_the_file(tmp_path: Path) -> None:
    path = written(tmp_path)
    motion = read_poses_for(path, TEN_PARTS, range(20, 30))
    np.testing.assert_allclose(motion.times_s, np.arange(20, 30) / RATE, atol=1e-6)
    with pytest.raises(UserError, match=r"no frame of range.*allowed: of its frames, 12 to 101"):
        read_poses_for(path, TEN_PARTS, range(500, 600))


@pytest.mark.parametrize("rest", [0, 1, 3, REST_ROWS])
def test_a_rest_pose_at_the_beginning_is_omitted(tmp_path: Path, rest: int) -> None:
    motion = read_poses_for(written(tmp_path, rest), TEN_PARTS)
    assert [pose is None for pose in motion.poses] == [True] * rest + [False] * (90 - rest)
    assert list(motion.known) == [False] * rest + [True] * (90 - rest)


def test_poses_in_long_gaps_are_unknown(tmp_path: Path) -> None:
    assert read_poses_for(written(tmp_path, unknown=range(30, 40)), TEN_PARTS).known.all()
    known = read_poses_for(written(tmp_path, unknown=range(30, 60)), TEN_PARTS).known
    assert list(np.flatnonzero(~known)) == list(range(30, 60))


def test_a_take_read_in_its_own_anatomy_has_the_recorded_poses() -> None:
    track = read_poses(GOLDEN).track()
    motion = read_poses_for(GOLDEN, TEN_PARTS)
    for row in np.flatnonzero(track.known)[::9]:
        pose = motion.poses[track.frames[row]]
        np.testing.assert_array_equal(pose.angles, track.angles[row])
    assert motion.known.sum() == track.known.sum()


def test_other_suffixes_raise_an_error_that_names_the_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"a\.fbx: suffix '\.fbx': allowed: \.bvh, \.trc, \.c3d, \.mcap"):
        read_poses_for(tmp_path / "a.fbx", TEN_PARTS)
