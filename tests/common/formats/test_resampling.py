"""Resampling: exact grid, rows on the grid unchanged, rotations at constant speed, gaps kept."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from tests.support.pose_tracks import moving, tracks
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack, rate_of
from zenocap.common.formats.resampling import MAX_GAP_S, resampled

few_examples = settings(deadline=None, max_examples=50)


def turns(track: PoseTrack, joint: str, axes: str) -> Rotation:
    at = TEN_PARTS.index[f"{joint}.{axes[0]}"]
    return Rotation.from_matrix(euler_to_matrix(axes, track.angles[:, at : at + len(axes)]))


@pytest.mark.nightly
@given(track=tracks(), fps=st.floats(1, 240))
@few_examples
def test_rows_are_at_exact_multiples_inside_the_track(track: PoseTrack, fps: float) -> None:
    if track.times_s[-1] * fps < 1:
        fps = 2 * track.rate
    out = resampled(track, fps)
    np.testing.assert_array_equal(out.times_s, out.frames / fps)
    assert (np.diff(out.frames) == 1).all()
    assert out.frames[0] == 0
    assert track.times_s[-1] - 1 / fps < out.times_s[-1] <= track.times_s[-1] + 1e-6
    assert out.rate == fps


@pytest.mark.nightly
@given(track=tracks())
@few_examples
def test_rows_on_the_grid_are_unchanged(track: PoseTrack) -> None:
    out = resampled(track, 3 * track.rate)
    known = track.known
    np.testing.assert_array_equal(out.positions[::3][known], track.positions[known])
    np.testing.assert_allclose(out.trajectories().points[::3][known], track.trajectories().points[known], atol=1e-9)
    assert [out.lost[3 * row] for row in np.flatnonzero(known)] == [""] * np.count_nonzero(known)


@pytest.mark.parametrize(
    ("joint", "axes"), [("navel", "yxz"), ("neck", "zxy"), ("left_shoulder", "zxy"), ("right_hip", "zxy")]
)
def test_joints_rotate_like_an_independent_slerp(joint: str, axes: str) -> None:
    track = moving(30, seed=4, rate=15.0)
    out = resampled(track, 100.0)
    expected = Slerp(track.times_s, turns(track, joint, axes))(out.times_s)
    off = (expected.inv() * turns(out, joint, axes)).magnitude()
    assert off.max() < 1e-9


def test_equivalent_euler_angles_are_interpolated_without_detour() -> None:
    """A tracker may switch between two angle triples of one rotation; nothing moves then."""
    track = moving(2, rate=15.0)
    at = TEN_PARTS.index["left_shoulder.z"]
    angles = track.angles.copy()
    angles[1] = angles[0]
    z, x, y = angles[0, at : at + 3]
    angles[1, at : at + 3] = (z + np.pi, np.pi - x, y + np.pi)
    still = replace(track, angles=angles, positions=track.positions[[0, 0]])
    points = resampled(still, 90.0).trajectories().points
    np.testing.assert_allclose(points, np.broadcast_to(points[0], points.shape), atol=1e-9)


def test_short_gaps_and_slow_takes_are_interpolated_and_long_gaps_are_not() -> None:
    out = resampled(moving(40, rate=30.0, lost=tuple(range(10, 17))), 60.0)
    assert not out.known[(out.times_s > 9.1 / 30) & (out.times_s < 16.9 / 30)].any()
    assert out.known[(out.times_s <= 9 / 30) | (out.times_s >= 17 / 30)].all()
    assert {out.lost[k] for k in np.flatnonzero(~out.known)} == {"person"}
    lost = tuple(range(10, 10 + int(MAX_GAP_S * 30) - 1))
    assert resampled(moving(40, rate=30.0, lost=lost), 60.0).known.all()
    assert resampled(moving(5, rate=2.0), 10.0).known.all()


def test_times_with_jitter_are_resampled_to_the_grid() -> None:
    """A straight walk sampled at irregular times is straight at regular ones."""
    track = moving(60, rate=30.0)
    times_s = track.times_s + np.random.default_rng(3).uniform(-0.01, 0.01, 60)
    times_s[0] = 0.0
    positions = np.stack([0.9 * times_s, np.ones(60), -0.3 * times_s], axis=1)
    jittering = replace(track, times_s=times_s, positions=positions, rate=rate_of(track.frames, times_s))
    out = resampled(jittering, 25.0)
    np.testing.assert_allclose(out.positions[:, 0], 0.9 * out.times_s, atol=1e-9)


def test_a_rate_without_any_row_is_refused() -> None:
    late = moving(2, first=1, rate=30.0)
    with pytest.raises(UserError, match=r"--fps 7: no multiple of 1/7 s"):
        resampled(late, 7.0)
    with pytest.raises(UserError, match="more than 10000000 rows"):
        resampled(replace(late, times_s=np.array([0.0, 1e6])), 1000.0)
