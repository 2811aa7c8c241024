"""BVH writer: two independent readers reproduce the joint centres of the pose."""

from pathlib import Path

import bvhio
import numpy as np
import pytest
from bvh import Bvh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.pose_tracks import NAMES, moving, track_of, tracks
from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.pose_track import PoseTrack, every_frame, holding
from zenocap.common.formats.trajectories import MATRICES, PER_METRE, Axes, Unit, convert

MILLIMETRE = 1e-3
JOINTS = {
    "Hip": "Hips", "RHip": "RightUpLeg", "RKnee": "RightLeg", "RAnkle": "RightFoot", "LHip": "LeftUpLeg",
    "LKnee": "LeftLeg", "LAnkle": "LeftFoot", "RShoulder": "RightArm", "RElbow": "RightForeArm", "RWrist": "RightHand",
    "LShoulder": "LeftArm", "LElbow": "LeftForeArm", "LWrist": "LeftHand",
}  # fmt: skip
files = settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


def centres_by_name(places: dict[str, Floats]) -> Floats:
    """(markers, 3) in our order; Neck is the middle of the shoulders."""
    places = {ours: places[theirs] for ours, theirs in JOINTS.items()} | {"Head": places["Head end"]}
    places["Neck"] = (places["RShoulder"] + places["LShoulder"]) / 2
    return np.stack([places[name] for name in NAMES])


def read_by_text(path: Path) -> Floats:
    """(n, markers, 3) in the file's unit: text read by the `bvh` package, kinematics by the format's definition."""
    file = Bvh(path.read_text())
    frames = []
    for frame in range(file.nframes):
        places: dict[str, Floats] = {}
        turns: dict[str, Floats] = {}
        for joint in file.get_joints():
            name, parent = joint.name, file.joint_parent(joint.name)
            place, rotation = np.array(file.joint_offset(name)), np.eye(3)
            for channel in file.joint_channels(name):
                value = file.frame_joint_channel(frame, name, channel)
                if channel.endswith("position"):
                    place["XYZ".index(channel[0])] = value
                else:
                    rotation = rotation @ Rotation.from_euler(channel[0], value, degrees=True).as_matrix()
            places[name] = place if parent is None else places[parent.name] + turns[parent.name] @ place
            turns[name] = rotation if parent is None else turns[parent.name] @ rotation
            for end in joint.filter("End"):
                places[f"{name} end"] = places[name] + turns[name] @ np.array([float(x) for x in end["OFFSET"]])
        frames.append(centres_by_name(places))
    return np.stack(frames)


def read_by_bvhio(path: Path) -> Floats:
    """The same by the `bvhio` package, kinematics too."""
    container = bvhio.readAsBvh(str(path))
    ends = {layout[0].Name: layout[0].EndSite for layout in container.Root.layout()}
    root = bvhio.readAsHierarchy(str(path))
    frames = []
    for frame in range(container.FrameCount):
        root.loadPose(frame)
        joints = [found for found, _, _ in root.layout()]
        places = {joint.Name: np.array(joint.PositionWorld) for joint in joints}
        head = next(joint for joint in joints if joint.Name == "Head")
        places["Head end"] = np.array(head.PositionWorld) + np.array(head.RotationWorld * ends["Head"])
        frames.append(centres_by_name(places))
    return np.stack(frames)


def furthest_m(found: Floats, track: PoseTrack, axes: Axes = "y-up", unit: Unit = "cm") -> float:
    """Largest distance between the joint centres read and those of the track, metres."""
    expected = convert(holding(track).trajectories().points, axes)
    return float(np.linalg.norm(found / PER_METRE[unit] - expected, axis=2).max())


@pytest.mark.nightly
@given(track=tracks(), axes=st.sampled_from(list(MATRICES)), unit=st.sampled_from(list(PER_METRE)))
@files
def test_joint_centres_round_trip_in_any_axes_and_unit(track: PoseTrack, axes: Axes, unit: Unit, tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", track, axes=axes, unit=unit)
    assert furthest_m(read_by_text(tmp_path / "a.bvh"), track, axes, unit) < 0.01 * MILLIMETRE


@pytest.mark.nightly
@given(track=tracks())
@files
def test_bvhio_finds_the_joint_centres(track: PoseTrack, tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", track)
    assert furthest_m(read_by_bvhio(tmp_path / "a.bvh"), track) < 0.1 * MILLIMETRE


@pytest.mark.slow
def test_the_rest_pose_is_a_t_pose_in_the_world(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", moving())
    lines = (tmp_path / "a.bvh").read_text().splitlines()
    row = lines.index("MOTION") + 3
    channels = len(lines[row].split())
    lines[row] = " ".join(["0"] * channels)
    (tmp_path / "rest.bvh").write_text("\n".join(lines) + "\n")
    rest = dict(zip(NAMES, read_by_text(tmp_path / "rest.bvh")[0], strict=True))
    arms = ("RWrist", "RElbow", "RShoulder", "Neck", "LShoulder", "LElbow", "LWrist")
    assert np.ptp([rest[name][1] for name in arms]) == pytest.approx(0, abs=1e-5)
    assert (np.diff([rest[name][0] for name in arms]) > 5).all()  # cm, from the person's right to the left
    assert rest["Head"][1] > rest["Neck"][1] > 0 > rest["LKnee"][1] > rest["LAnkle"][1]
    assert rest["LKnee"][0] == pytest.approx(rest["LHip"][0])


def test_bones_have_the_names_that_other_programs_expect(tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", moving())
    names = Bvh((tmp_path / "a.bvh").read_text()).get_joints_names()
    bones = ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")
    twins = [f"{side}{bone}" for side in ("Left", "Right") for bone in bones]
    assert sorted(names) == sorted(["Hips", "Spine", "Spine1", "Neck", "Head", *twins])


def test_angles_are_continuous(tmp_path: Path) -> None:
    """A person who turns repeatedly and swings an arm over the head: no jump in any solution."""
    track = moving(200)
    angles = np.tile(track.anatomy.neutral, (200, 1))
    turns = np.linspace(0, 6 * np.pi, 200)
    angles[:, track.anatomy.index["navel.y"]] = turns
    angles[:, track.anatomy.index["left_shoulder.x"]] = np.pi * np.sin(turns)
    write_bvh(tmp_path / "a.bvh", track_of(np.zeros((200, 3)), angles))
    rows = [line.split() for line in (tmp_path / "a.bvh").read_text().splitlines() if line[:1] in "-0123456789"]
    motion = np.array([[float(cell) for cell in row] for row in rows])
    assert motion.shape[0] == 200
    assert np.abs(np.diff(motion[:, 3:], axis=0)).max() < 25  # the arm's own fastest step is 17 degrees
    assert motion[-1, 5] - motion[0, 5] == pytest.approx(3 * 360, abs=1e-3)


def test_lost_frames_repeat_the_previous_pose_and_leading_ones_the_next_pose(tmp_path: Path) -> None:
    track = moving(6, lost=(0, 3, 5))
    write_bvh(tmp_path / "a.bvh", track)
    found = read_by_text(tmp_path / "a.bvh")
    for row, source in enumerate((1, 1, 2, 2, 4, 4)):
        np.testing.assert_array_equal(found[row], found[source])
    assert furthest_m(found, track) < 0.01 * MILLIMETRE


@pytest.mark.slow
def test_row_k_is_frame_k(tmp_path: Path) -> None:
    track = moving(4, first=7)
    write_bvh(tmp_path / "a.bvh", every_frame(track))
    found = read_by_text(tmp_path / "a.bvh")
    assert len(found) == 11
    np.testing.assert_allclose(found[7:] / 100, track.trajectories().points, atol=1e-5)


@pytest.mark.parametrize("rate", [15.0, 29.97, 60.0, 119.88])
def test_the_frame_time_is_the_inverse_of_the_rate(rate: float, tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", moving(rate=rate))
    assert 1 / Bvh((tmp_path / "a.bvh").read_text()).frame_time == pytest.approx(rate, rel=1e-5)


def test_a_track_without_any_pose_raises_an_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="lost in every frame"):
        write_bvh(tmp_path / "a.bvh", moving(3, lost=(0, 1, 2)))
    assert list(tmp_path.iterdir()) == []
