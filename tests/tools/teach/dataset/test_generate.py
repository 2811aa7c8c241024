"""Generation of one take of the data set: its rig and its messages."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.formats.take_poses import read_poses
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import MotionTimeline
from zenocap.tools.teach.dataset.batch import PostureTake
from zenocap.tools.teach.dataset.generate import FPS, SIZES, Method, dataset_rig, generate_take

TAKE = PostureTake(5, "raise-right-arm", 0)


def short_timeline(until_s: float = 10.0) -> MotionTimeline:
    """The script of the take, with its last segment shortened."""
    whole = TAKE.timeline()
    *before, last = whole.segments
    return replace(whole, segments=(*before, replace(last, end_s=min(last.end_s, until_s))))


@pytest.mark.parametrize(("method", "viewers"), [("two-view", 2), ("hybrid-two-view", 2), ("hybrid", 4)])
def test_dataset_rig_has_the_image_size_and_rate_of_the_paper(method: Method, viewers: int) -> None:
    rig = dataset_rig(method)
    assert len(rig.viewers) == viewers
    assert SIZES["two-view"] == (160, 120)
    assert {viewer.camera.size for viewer in rig.viewers} == {SIZES[method]}
    assert {viewer.fps for viewer in rig.viewers} == {FPS}
    assert rig.method == ("two-view" if method == "two-view" else "hybrid")
    assert {viewer.silhouette for viewer in rig.viewers} == {method != "two-view"}
    assert {viewer.camera.size for viewer in dataset_rig(method, (640, 480)).viewers} == {(640, 480)}


@pytest.mark.slow
def test_ground_truth_takes_contain_the_true_angles(tmp_path: Path) -> None:
    one = short_timeline()
    tracked = generate_take(dataset_rig("truth"), "truth", one, TAKE.room, tmp_path / "one.mcap")
    poses = read_poses(tmp_path / "one.mcap")
    assert tracked.problems == ()
    assert tracked.poses == len(poses.baps) == int(one.duration_s * FPS) - 15  # without a second of empty scene
    for bap, time_s in zip(poses.baps, poses.times_s, strict=True):
        pose = one.pose_at(bap.frame / FPS)
        assert time_s == pytest.approx(bap.frame / FPS, abs=1e-6)
        expected = truth(one.person, pose).ten_part_pose()
        np.testing.assert_allclose(poses.pose(bap).angles, expected.angles)
        assert len(expected.angles) == len(TEN_PARTS.angles)


@pytest.mark.nightly
def test_equal_takes_have_equal_bytes_and_poses_up_to_the_last_frame(tmp_path: Path) -> None:
    one = short_timeline(3.6)
    for name in ("a", "b"):
        tracked = generate_take(dataset_rig("two-view"), "two-view", one, TAKE.room, tmp_path / f"{name}.mcap")
        assert tracked.problems == ()
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    found = read_poses(tmp_path / "a.mcap")
    assert found.frames[-1] == int(one.duration_s * FPS) - 1
    assert found.frames[0] < one.motion_from_s * FPS, "the body is measured before the posture begins"
    assert (tmp_path / "a.mcap").stat().st_size < 100_000, "silhouettes are not logged"
