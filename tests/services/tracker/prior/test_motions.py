"""Motion from files, takes and the simulated person, in coordinates without jumps."""

from pathlib import Path

import numpy as np
import pytest

from tests.common.body.test_inverse_kinematics import body, random_pose
from tests.support.anatomies import each_anatomy
from tests.support.places import CLIPS, GOLDEN, MOTIONS
from tests.support.pose_tracks import moving
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc
from zenocap.services.tracker.prior.motions import actor_motion, motion_of, read_motion

GOLDEN = GOLDEN / "arms.mcap"
CLIP = CLIPS / "walk7"
COORDINATES = coordinates_of(TEN_PARTS)
FASTEST = 30.0  # rad/s


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["walking", "running", "boxing"])
def test_simulated_motion_has_no_jumps(kind: str) -> None:
    motion = actor_motion(kind, 3, 1, FOURTEEN_PARTS, 30.0)
    assert motion.rate == 30.0
    assert motion.coordinates.shape[1] == coordinates_of(FOURTEEN_PARTS).dimension
    assert len(motion.coordinates) > 20 * 30
    assert np.isfinite(motion.coordinates).all()
    assert np.abs(np.diff(motion.coordinates, axis=0)).max() * 30.0 < FASTEST
    again = actor_motion(kind, 3, 1, FOURTEEN_PARTS, 30.0)
    np.testing.assert_array_equal(again.coordinates, motion.coordinates)


def test_bvh_round_trip_keeps_the_motion(tmp_path: Path) -> None:
    track = moving(6)
    track.angles[:] = [random_pose(TEN_PARTS, seed).angles for seed in range(6)]
    write_bvh(tmp_path / "mine.bvh", track)
    motion = read_motion(tmp_path / "mine.bvh", TEN_PARTS)
    assert (motion.name, motion.rate) == ("mine", 30.0)
    assert motion.coordinates.shape == (6, COORDINATES.dimension)


def trc(folder: Path, anatomy: Anatomy = TEN_PARTS, count: int = 90) -> tuple[Path, Floats]:
    """File of a slowly raised arm, numbered from 10, and its coordinates."""
    poses = []
    for share in np.linspace(0, 1, count):
        angles = anatomy.neutral.copy()
        angles[anatomy.index["left_shoulder.z"]] += 1.2 * share
        for name, bend in (("elbow", 0.6), ("knee", -0.5)):
            for side in ("right", "left"):
                angles[anatomy.index[f"{side}_{name}.x"]] = bend
        poses.append(Pose(np.array([0.0, 1.0, share]), angles))
    points = np.array([joint_centres(anatomy, body(anatomy), pose) for pose in poses])
    frames = np.arange(10, 10 + count, dtype=np.int64)
    names = tuple(marker.name for marker in anatomy.markers)
    write_trc(folder / "raise.trc", Trajectories(names, frames, frames / 60.0, points, 60.0))
    return folder / "raise.trc", motion_of("raise", 60.0, anatomy, poses).coordinates


def test_trc_round_trip_keeps_the_motion_or_a_range(tmp_path: Path) -> None:
    path, expected = trc(tmp_path)
    motion = read_motion(path, TEN_PARTS)
    np.testing.assert_allclose(motion.coordinates, expected, atol=2e-3)
    part = read_motion(path, TEN_PARTS, range(30, 50))
    np.testing.assert_allclose(part.coordinates, expected[20:40], atol=5e-3)
    with pytest.raises(UserError, match=r"raise\.trc: no frame of range\(200, 300\): allowed: of its frames, 10 to 99"):
        read_motion(path, TEN_PARTS, range(200, 300))


def test_short_gaps_are_interpolated_and_long_ones_are_not(tmp_path: Path) -> None:
    path, expected = trc(tmp_path)
    lines = path.read_text().split("\n")
    for row in (*range(20, 25), *range(40, 70)):
        lines[6 + row] = "\t".join([*lines[6 + row].split("\t")[:2], *["nan"] * 45])
    path.write_text("\n".join(lines))
    found = read_motion(path, TEN_PARTS).coordinates
    assert set(np.flatnonzero(np.isnan(found).any(axis=1))) == set(range(40, 70))
    known = np.isfinite(found).all(axis=1)
    np.testing.assert_allclose(found[known], expected[known], atol=0.02)


def test_error_names_the_invalid_motion(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'flying' is not one of walking, running, boxing, general"):
        actor_motion("flying", 0, 0, TEN_PARTS)
    with pytest.raises(UserError, match=r"a\.fbx: suffix '\.fbx': allowed: \.bvh, \.trc, \.c3d, \.mcap"):
        read_motion(tmp_path / "a.fbx", TEN_PARTS)
    data = Trajectories(("Hip", "LKnee"), np.arange(2), np.arange(2) / 60, np.zeros((2, 2, 3)), 60.0)
    write_trc(tmp_path / "b.trc", data)
    with pytest.raises(UserError, match=r"b\.trc: no marker RHip, RKnee, .*; there are: Hip, LKnee"):
        read_motion(tmp_path / "b.trc", TEN_PARTS)


@pytest.mark.nightly
@pytest.mark.clips
@each_anatomy
@pytest.mark.parametrize("name", ["cmu_02_01", "cmu_02_03", "cmu_02_05", "cmu_07_03", "cmu_10_01"])
def test_motion_capture_has_no_jumps_and_no_rest_pose(name: str, anatomy: Anatomy) -> None:
    motion = read_motion(MOTIONS / f"{name}.bvh", anatomy)
    known = np.isfinite(motion.coordinates).all(axis=1)
    first = int(np.argmax(known))
    assert first <= 5
    assert known[first:].all()
    assert np.abs(np.diff(motion.coordinates[first:], axis=0)).max() * motion.rate < FASTEST


@pytest.mark.slow
@pytest.mark.clips
def test_walk_has_plausible_angles_from_bvh_and_ground_truth() -> None:
    frames = range(198, 198 + 171)  # of clip.toml: the motion of cmu_02_01
    ours = read_motion(MOTIONS / "cmu_02_01.bvh", FOURTEEN_PARTS)
    theirs = read_motion(CLIP / "truth.trc", FOURTEEN_PARTS, frames)
    at = coordinates_of(FOURTEEN_PARTS).names.index("left_knee.x")
    for motion in (ours, theirs):
        assert 55 < np.degrees(-motion.coordinates[:, at].min()) < 80
    assert np.corrcoef(ours.coordinates[:, at], theirs.coordinates[:, at])[0, 1] > 0.95


@pytest.mark.slow
@each_anatomy
def test_take_has_its_motion_in_either_anatomy(anatomy: Anatomy) -> None:
    motion = read_motion(GOLDEN, anatomy)
    known = np.isfinite(motion.coordinates).all(axis=1)
    assert motion.name == "arms"
    assert motion.rate == pytest.approx(read_poses(GOLDEN).rate())
    assert known.sum() > 10
    assert motion.coordinates.shape[1] == coordinates_of(anatomy).dimension
    with pytest.raises(UserError, match=r"arms\.mcap: no frame of range\(90000, 90001\): allowed: of its frames"):
        read_motion(GOLDEN, anatomy, range(90_000, 90_001))


@pytest.mark.slow
def test_take_in_its_own_anatomy_has_the_poses_of_its_messages() -> None:
    track = read_poses(GOLDEN).track()
    motion = read_motion(GOLDEN, TEN_PARTS)
    for row in np.flatnonzero(track.known)[::7]:
        found, expected = (
            joint_centres(TEN_PARTS, body(TEN_PARTS), Pose(np.zeros(3), COORDINATES.angles(values, np.eye(3))))
            for values in (motion.coordinates[track.frames[row]], COORDINATES.of_pose(track.pose(int(row))))
        )
        np.testing.assert_allclose(found, expected, atol=1e-6)
