"""Scoring of trials: poses where both cameras filmed, at the times of the truth."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.video_trials import at_times, true_class
from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.recordings.evaluate import Selection, accuracy


def walking(count: int) -> Trajectories:
    """A person who walks 1 m/s on a curve, at 30 frames/s."""
    times_s = np.arange(count) / 30.0
    path = np.stack([np.sin(times_s), np.zeros(count), np.cos(times_s)], axis=1)
    joints = np.array([[0.1, 0.9, 0.0], [-0.1, 0.9, 0.0], [0.0, 1.4, 0.0]])
    points = path[:, None] + joints
    return Trajectories(("LHip", "RHip", "Neck"), np.arange(count, dtype=np.int64), times_s, points, 30.0)


def rows(track: Trajectories, kept: list[int]) -> Trajectories:
    return replace(
        track, frames=np.arange(len(kept), dtype=np.int64), times_s=track.times_s[kept], points=track.points[kept]
    )


def test_a_take_at_half_the_rate_is_whole() -> None:
    truth = walking(21)
    found = accuracy(at_times(rows(truth, list(range(0, 21, 2))), truth), truth, Selection())
    assert found.lost_pct == 0.0
    assert found.mpjpe_mm < 1.0
    assert true_class(found) == "good"


def test_two_missing_frames_in_a_row_are_lost_and_one_is_not() -> None:
    truth = walking(20)
    found = accuracy(at_times(rows(truth, [k for k in range(20) if k not in (4, 9, 10)]), truth), truth, Selection())
    assert found.lost_pct == pytest.approx(10.0)
    assert true_class(found) == "doubtful"


def test_frames_before_and_after_the_take_are_lost() -> None:
    truth = walking(20)
    found = at_times(rows(truth, list(range(5, 15))), truth)
    assert np.flatnonzero(np.isfinite(found.points[:, 0, 0])).tolist() == list(range(5, 15))
