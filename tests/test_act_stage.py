"""The stage of acted takes: what its rigs are, and what a take of it says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.actor.script import Script
from common.actor.truth import truth
from common.body.anatomy import TEN_PARTS
from common.formats.poses import read_poses
from services.takes.act.cast import Act
from services.takes.act.stage import FPS, SIZES, Method, act, stage

ACT = Act(5, "raise-right-arm", 0)


def script(until_s: float = 10.0) -> Script:
    """The act's; its last segment cut off."""
    whole = ACT.script()
    *before, last = whole.segments
    return replace(whole, segments=(*before, replace(last, end_s=min(last.end_s, until_s))))


@pytest.mark.parametrize(("method", "viewers"), [("two-view", 2), ("hybrid", 4)])
def test_a_stage_films_small_and_slowly_as_the_paper_does(method: Method, viewers: int) -> None:
    rig = stage(method)
    assert len(rig.viewers) == viewers
    assert SIZES["two-view"] == (160, 120)
    assert {viewer.camera.size for viewer in rig.viewers} == {SIZES[method]}
    assert {viewer.fps for viewer in rig.viewers} == {FPS}
    assert rig.method == method


def test_true_takes_hold_the_true_angles(tmp_path: Path) -> None:
    one = script()
    tracked = act(stage("truth"), "truth", one, ACT.room, tmp_path / "one.mcap")
    poses = read_poses(tmp_path / "one.mcap")
    assert tracked.problems == ()
    assert tracked.poses == len(poses.baps) == int(one.duration_s * FPS) - 15  # without a second of empty scene
    for bap, time_s in zip(poses.baps, poses.times_s, strict=True):
        pose = one.pose_at(bap.frame / FPS)
        assert pose is not None
        assert time_s == pytest.approx(bap.frame / FPS, abs=1e-6)
        expected = truth(one.person, pose).ten_part_pose()
        np.testing.assert_allclose(poses.pose(bap).angles, expected.angles)
        assert len(expected.angles) == len(TEN_PARTS.angles)


def test_the_same_act_gives_the_same_bytes_and_poses_of_every_instant(tmp_path: Path) -> None:
    one = script(3.6)
    for name in ("a", "b"):
        tracked = act(stage("two-view"), "two-view", one, ACT.room, tmp_path / f"{name}.mcap")
        assert tracked.problems == ()
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    found = read_poses(tmp_path / "a.mcap")
    assert found.frames[-1] == int(one.duration_s * FPS) - 1
    assert found.frames[0] < one.motion_from_s * FPS, "the body is measured before the posture begins"
    assert (tmp_path / "a.mcap").stat().st_size < 100_000, "silhouettes are not logged"
