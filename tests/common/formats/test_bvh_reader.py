"""BVH reader: joint positions agree with an independent reader; errors name the line."""

from pathlib import Path

import numpy as np
import pytest
from bvh import Bvh as OtherBvh
from hypothesis import HealthCheck, given, settings

from tests.common.formats.test_bvh_writer import centres_by_name, read_by_text
from tests.support.places import MOTIONS
from tests.support.pose_tracks import tracks
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_reader import read_bvh
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import PER_METRE

TEXT = """\
HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Left Leg {
    OFFSET 0 -4 0
    CHANNELS 4 Xrotation Xposition Yposition Zposition
    End Site
    {
      OFFSET 0 -5 0
    }
  }
}
MOTION
Frames:\t2
Frame Time: 0.016667
10 0 0 90 0 0  0 0 -4 0
10 0 0 0 0 0  90 1 -4 0
"""


def written(folder: Path, text: str) -> Path:
    (folder / "a.bvh").write_text(text)
    return folder / "a.bvh"


def test_names_with_spaces_braces_on_any_line_and_positions_of_any_joint_are_read(tmp_path: Path) -> None:
    file = read_bvh(written(tmp_path, TEXT))
    assert file.names == ("Hips", "Left Leg", "Left Leg end")
    assert file.parents == (-1, 0, 1)
    assert file.rate == 60.0
    expected = [[[10, 0, 0], [14, 0, 0], [19, 0, 0]], [[10, 0, 0], [11, -4, 0], [11, -4, -5]]]
    np.testing.assert_allclose(file.points, expected, atol=1e-12)


@pytest.mark.nightly
@given(track=tracks())
@settings(deadline=None, max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_joint_positions_equal_those_of_another_reader(track: PoseTrack, tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    write_bvh(path, track)
    file = read_bvh(path)
    ours = [centres_by_name(dict(zip(file.names, row, strict=True))) for row in file.points]
    np.testing.assert_allclose(np.array(ours), read_by_text(path), atol=1e-9 * PER_METRE["cm"])
    assert file.rate == pytest.approx(track.rate, rel=5e-4)


@pytest.mark.parametrize(
    ("good", "bad", "message"),
    [
        ("HIERARCHY", "HIERACHY", r"a.bvh: line 1: 'HIERACHY': allowed: HIERARCHY"),
        ("ROOT Hips", "JOINT Hips", r"line 2: 'JOINT Hips': allowed: one ROOT NAME"),
        ("OFFSET 1 2 3", "OFFSET 1 2", r"line 4: 'OFFSET 1 2': allowed: OFFSET and three numbers"),
        ("CHANNELS 4", "CHANNELS 3", r"line 8: 'CHANNELS 3 Xrotation .*: allowed: CHANNELS, their number"),
        ("4 Xrotation", "4 Wrotation", r"line 8: .*allowed: CHANNELS"),
        ("      OFFSET 0 -5 0\n", "", r"line 11: '}': allowed: an OFFSET of Left Leg end"),
        ("MOTION", "EMOTION", r"line 15: 'EMOTION': allowed: MOTION"),
        ("Frames:\t2", "Frames: two", r"line 16: 'Frames: two': allowed: Frames: and a number"),
        ("Frames:\t2", "Frames: 3", r"Frames: 3, but there are 2 rows"),
        ("0.016667", "0", r"line 17: 'Frame Time: 0': allowed: Frame Time"),
        ("  90 1 -4 0", "  90 1 -4", r"line 19: 9 cells: allowed: 10 numbers"),
        ("  90 1 -4 0", "  90 1 -4 nan", r"line 19: not all numbers are finite"),
        (TEXT[TEXT.index("MOTION") :], "", r"ends before MOTION"),
        (TEXT[TEXT.index("    End Site") :], "", r"ends before the rest of the HIERARCHY"),
    ],
)
def test_errors_name_the_line(good: str, bad: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=message):
        read_bvh(written(tmp_path, TEXT.replace(good, bad, 1)))


@pytest.mark.slow
@pytest.mark.clips
@pytest.mark.parametrize("name", ["cmu_02_03", "cmu_11_01"])
def test_motion_capture_has_the_joint_count_of_another_reader(name: str) -> None:
    path = MOTIONS / f"{name}.bvh"
    file, other = read_bvh(path), OtherBvh(path.read_text())
    assert [joint for joint in file.names if not joint.endswith(" end")] == other.get_joints_names()
    assert len(file.points) == other.nframes


def test_many_joints_without_channels_are_refused_before_memory_is_used(tmp_path, monkeypatch):
    monkeypatch.setattr("zenocap.common.formats.bvh_reader.MAX_NUMBERS", 12 * 100)
    ends = "End Site\n{\nOFFSET 0 0 0\n}\n" * 50
    joints = f"ROOT r\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n{ends}}}"
    path = written(tmp_path, f"HIERARCHY\n{joints}\nMOTION\nFrames: 2\nFrame Time: 0.1\n0\n0\n")
    with pytest.raises(UserError, match="51 joints in 2 frames, 1224 numbers: allowed: 1200"):
        read_bvh(path)
