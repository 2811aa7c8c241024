"""Scorer: definition of its figures, and agreement with the shared scorer."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_trc import SCORER, walking
from tests.support.angle_cases import take_of, walking_person
from tests.support.command import zenocap
from tests.support.package_rows import add_row
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.errors import UserError
from zenocap.common.formats.import_format import IMPORTS, ImportFormat
from zenocap.common.formats.pose_track import Bound
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy, check_truth, doubts, pairing_notes

ALL = ScoredFrames()


def moved(truth: Trajectories, by: object) -> Trajectories:
    return replace(truth, points=truth.points + np.asarray(by))


def test_error_of_a_shifted_track_equals_the_shift() -> None:
    same, shifted = (accuracy(moved(walking(), shift), walking(), ALL) for shift in ([0, 0, 0], [0.03, 0.0, 0.04]))
    assert (same.mpjpe_mm, same.rmse_mm, same.shape_mm, same.lost_pct) == (0, 0, 0, 0)
    assert (shifted.mpjpe_mm, shifted.rmse_mm, shifted.lost_pct) == (pytest.approx(50.0), pytest.approx(50.0), 0)


def test_constant_offset_in_the_body_frame_causes_no_shape_error() -> None:
    """A joint defined 5 cm lower in its body has no shape error at any heading of the body."""
    still = walking(6)
    body = np.where(np.isnan(still.points[0]), 0.0, still.points[0])
    points = np.stack([_turned(body, angle) for angle in np.linspace(0, 2, 6)])
    offset = np.zeros_like(body)
    offset[3] = [0.05, 0.0, 0.0]
    # The same offset, turned with the body.
    track = points + np.stack([_turned(offset, angle) for angle in np.linspace(0, 2, 6)])
    found = accuracy(replace(still, points=track), replace(still, points=points), ALL)
    assert found.mpjpe_mm == pytest.approx(50.0 / 15)
    assert found.shape_mm == pytest.approx(0.0, abs=1e-6)


def test_missing_and_distant_joints_count_as_lost() -> None:
    truth = walking()
    track = walking()
    track.points[0, 0] = np.nan
    track.points[1, 0] += 0.2  # 346 mm away
    found = accuracy(track, truth, ALL)
    assert found.lost_pct == pytest.approx(100 * 2 / (11 * 15))


def test_selection_limits_the_scored_frames() -> None:
    truth = walking()
    assert accuracy(truth, truth, ScoredFrames(first=Bound(8), last=Bound(12))).frames == 5
    start_s, end_s = truth.times_s[truth.frames == 8][0], truth.times_s[truth.frames == 12][0]
    assert accuracy(truth, truth, ScoredFrames(first=Bound(start_s, True), last=Bound(end_s, True))).frames == 5
    assert accuracy(truth, truth, ScoredFrames(every=2)).frames == 6
    later = replace(truth, frames=truth.frames + 3, times_s=truth.times_s + 3 / 30)
    assert accuracy(later, truth, ScoredFrames(offset=3)).mpjpe_mm == 0


def test_no_common_joint_or_frame_is_an_error() -> None:
    truth = walking()
    with pytest.raises(UserError, match="no joint in common"):
        accuracy(replace(truth, names=tuple(f"x{name}" for name in truth.names)), truth, ALL)
    with pytest.raises(UserError, match="no frame in common"):
        accuracy(truth, truth, ScoredFrames(offset=1000))


@pytest.mark.slow
@pytest.mark.skipif(not SCORER.exists(), reason="the shared scorer is not beside the project")
def test_figures_agree_with_the_shared_scorer(tmp_path: Path) -> None:
    truth, rng = walking(40), np.random.default_rng(7)
    track = moved(truth, rng.normal(0, 0.1, truth.points.shape))
    track.points[5, 3] = np.nan
    track = replace(track, points=track.points[1:30], frames=track.frames[1:30], times_s=track.times_s[1:30])
    write_trc(tmp_path / "track.trc", track)
    write_trc(tmp_path / "truth.trc", truth)
    command = [
        sys.executable, str(SCORER), str(tmp_path / "track.trc"), str(tmp_path / "truth.trc"), "--from", "9", "--json",
    ]  # fmt: skip
    shared = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    ours = accuracy(track, truth, ScoredFrames(first=Bound(9)))
    for name in ("frames", "joints", "mpjpe_mm", "rmse_mm", "shape_mm", "median_mm", "lost_pct"):
        assert getattr(ours, name) == pytest.approx(shared[name], abs=0.011), name


def filmed(count: int, rate: float, step: int = 1, first: int = 0) -> Trajectories:
    """Every step-th of `count` frames that were filmed at `rate` frames/s."""
    frames = np.arange(first, count, step)
    return Trajectories(("Hip",), frames, frames / rate, np.zeros((len(frames), 1, 3)), rate / step)


def numbered(data: Trajectories, by: int, count: int | None = None) -> Trajectories:
    """The same with numbers that are `by` higher; with a count, from `by` on."""
    frames = data.frames + by if count is None else np.arange(by, by + count)
    return replace(data, frames=frames)


@pytest.mark.parametrize(
    ("take", "truth", "every", "offset", "note"),
    [
        (filmed(100, 30.0), filmed(100, 29.97), 1, 0, None),
        (filmed(100, 60.0, step=2), filmed(100, 60.0), 2, 0, None),
        (filmed(120, 30.0, first=20), filmed(100, 30.0), 1, 20, None),
        (filmed(99, 30.0), filmed(200, 60.0), 1, 0, "frame 98 of the truth is at 1.633 s, and that of the take at 3.267 s"),
        (filmed(100, 30.0), numbered(filmed(100, 30.0), 1), 1, 0, "frame 99 of the truth is at 3.267 s"),
        (filmed(100, 30.0), numbered(filmed(100, 30.0), 1), 1, 1, "frame 98 of the truth is at 3.233 s"),
        (filmed(100, 60.0, step=2), filmed(100, 60.0), 1, 0, "give --every 2"),
    ],
    ids=["equal", "every second", "offset", "half the rate", "from 1", "from 1, with an offset", "every second, not given"],
)
def test_frames_of_equal_numbers_at_other_times_need_a_note(
    take: Trajectories, truth: Trajectories, every: int, offset: int, note: str | None
) -> None:
    selection = ScoredFrames(every=every, offset=offset)
    found = list(pairing_notes(take, truth, selection))
    assert found == [] if note is None else note in found[0]


def test_a_truth_that_counts_from_1_is_paired_by_time() -> None:
    """As in files of OpenSim, Cortex and Vicon: Frame# 1 at Time 0."""
    truth = walking()
    assert accuracy(numbered(truth, -1), truth, ALL).mpjpe_mm == 0
    half = replace(truth, frames=truth.frames[::2], times_s=truth.times_s[::2], points=truth.points[::2], rate=15.0)
    found = accuracy(half, truth, ALL)
    assert (found.mpjpe_mm, found.lost_pct, found.frames) == (0, 0, 5)  # a row has no estimate


def test_rows_that_a_take_leaves_out_are_lost_also_where_they_are_most() -> None:
    truth = walking(31)
    kept = np.arange(4, 31, 3)
    take = replace(truth, frames=truth.frames[kept], times_s=truth.times_s[kept], points=truth.points[kept])
    found = accuracy(take, truth, ALL)
    assert (found.frames, found.mpjpe_mm) == (30, 0.0)
    assert found.lost_pct == pytest.approx(100.0 * 21 / 30)


def test_a_truth_whose_numbers_and_times_begin_again_gets_the_better_offset() -> None:
    track = walking(60)
    cut = numbered(replace(track, points=track.points[20:], times_s=track.times_s[:40] - track.times_s[0]), 0, 40)
    found = accuracy(track, cut, ALL)
    (doubt,) = doubts(track, cut, ALL, found.mpjpe_mm)
    assert doubt.startswith(f"with --offset 25 the mean error is 0 mm instead of {found.mpjpe_mm:.0f}: do numbers")
    assert accuracy(track, cut, ScoredFrames(offset=25)).mpjpe_mm == pytest.approx(0.0)
    late = replace(cut, times_s=cut.times_s + 3600.0)
    with pytest.raises(UserError, match=r"no frame in common .*: with --offset -107975 the mean error is 0 mm"):
        accuracy(track, late, ALL)
    assert doubts(track, walking(60, seed=2), ALL, found.mpjpe_mm) == []


def mirrored(truth: Trajectories) -> Trajectories:
    return replace(truth, names=tuple(name.translate({ord("R"): "L", ord("L"): "R"}) for name in truth.names))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (mirrored, "with left and right of the truth exchanged the mean error is 0 mm"),
        (lambda one: replace(one, points=one.points / 1e3), "with the truth times 1000 the mean error is 0 mm"),
        (lambda one: replace(one, points=one.points * 1e3), "are its numbers in mm in place of m?"),
        (lambda one: replace(one, points=one.points * 0.3048), "are its numbers in feet?"),
        (lambda one: replace(one, points=one.points[..., [2, 1, 0]] * [1, 1, -1]), "with the truth turned by -90 degrees"),
        (lambda one: replace(one, points=one.points * [-1, 1, -1]), "with the truth turned by 180 degrees about Y"),
        (lambda one: moved(one, [0.3, 0.0, 0.0]), None),
    ],
    ids=["sides", "mm", "m", "feet", "X to the front", "backwards", "moved"],
)
def test_a_truth_of_other_sides_or_another_unit_is_doubted(
    changed: Callable[[Trajectories], Trajectories], words: str | None
) -> None:
    truth = changed(walking())
    found = doubts(walking(), truth, ALL, accuracy(walking(), truth, ALL).mpjpe_mm)
    assert found == [] if words is None else words in found[0]


@pytest.mark.slow
def test_a_doubt_comes_first_and_with_status_3(tmp_path: Path) -> None:
    """A truth that was cropped, and whose numbers and times begin again."""
    take = take_of(tmp_path / "walk.mcap", walking_person(TEN_PARTS, 60))
    whole = read_poses(take).track().trajectories()
    assert not np.isnan(whole.points).any()
    count = len(whole.frames) - 25
    cut = replace(whole, points=whole.points[25:], frames=np.arange(count), times_s=whole.times_s[:count])
    write_trc(tmp_path / "whole.trc", whole)
    write_trc(tmp_path / "cut.trc", cut)
    for truth, options, expected in (
        ("whole", [], 0),
        ("cut", [], 3),
        ("cut", ["--angles"], 3),
        ("cut", ["--offset", 25], 0),
    ):
        status, text, problems = zenocap("evaluate", take, "--truth", tmp_path / f"{truth}.trc", *options)
        assert status == expected, (truth, options, text, problems)
        assert text.startswith("doubtful: with --offset 25 the mean error is 0 ") == (expected == 3), text
    status, text, _ = zenocap("evaluate", take, "--truth", tmp_path / "cut.trc", "--json")
    assert (status, len(json.loads(text)["doubts"])) == (3, 1)


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T


@pytest.mark.parametrize(
    ("angles", "allowed"), [(True, r"\.mot, \.trc, \.sto, \.mcap$"), (False, r"\.trc, \.sto, \.mcap$")]
)
def test_files_of_a_truth_are_those_of_the_import_formats(
    angles: bool, allowed: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(IMPORTS, "own", {"trc": IMPORTS.own["trc"]})
    add_row(monkeypatch, IMPORTS, "sto", ImportFormat("sto", (".sto",), "more:read"))
    check_truth(tmp_path / "a.sto", angles=angles)
    for suffix in (".bvh", ".c3d"):
        with pytest.raises(UserError, match=f"suffix '{suffix}': allowed for joint .*: {allowed}"):
            check_truth(tmp_path / f"a{suffix}", angles=angles)
