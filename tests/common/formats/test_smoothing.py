"""Smoothing of recorded poses: attenuation of theory, no delay, gaps, jumps, short stretches."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.pose_tracks import moving, track_of
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.pose_rotations import joint_angles, pose_rotations
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.smoothing import description, lowpass, smoothed, too_short

few_examples = settings(deadline=None, max_examples=30)
ANGLES = len(TEN_PARTS.angles)
NAVEL = TEN_PARTS.index["navel.y"]


def gentle(count: int, *, rate: float = 30.0, seed: int = 0, noise: float = 0.03) -> PoseTrack:
    """Continuous motion about the neutral pose with noise: (m, rad), turning about the vertical by several turns."""
    random, times_s = np.random.default_rng(seed), np.arange(count) / rate
    phase = random.uniform(0, 2 * np.pi, ANGLES)
    angles = TEN_PARTS.neutral + 0.4 * np.sin(2 * np.pi * 0.7 * times_s[:, None] + phase)
    angles[:, NAVEL] = 2.0 * times_s
    positions = np.stack([0.5 * times_s, np.ones(count), np.sin(times_s)], axis=1)
    noisy = positions + 0.3 * noise * random.standard_normal((count, 3))
    return track_of(noisy, angles + noise * random.standard_normal(angles.shape), rate=rate)


def with_gap(track: PoseTrack, gone: Sequence[int]) -> PoseTrack:
    """The track with these rows lost."""
    positions, angles = track.positions.copy(), track.angles.copy()
    positions[gone] = angles[gone] = np.nan
    lost = tuple("person" if row in gone else "" for row in range(len(positions)))
    return replace(track, positions=positions, angles=angles, lost=lost)


def rotations(track: PoseTrack) -> Floats:
    """(n, 3, 3) of the root, part to world."""
    return euler_to_matrix("yxz", track.angles[:, NAVEL : NAVEL + 3])


@pytest.mark.parametrize("rate", [15.0, 29.97, 60.0])
def test_a_person_at_rest_is_unchanged(rate: float) -> None:
    angles = np.tile(TEN_PARTS.neutral, (50, 1))
    track = track_of(np.full((50, 3), 0.9), angles, rate=rate)
    out = smoothed(track, 6.0)
    np.testing.assert_allclose(out.positions, track.positions, atol=1e-12)
    np.testing.assert_allclose(out.angles, track.angles, atol=1e-9)


@pytest.mark.parametrize("hz", [0.5, 1.0, 3.0, 6.0, 9.0])
@pytest.mark.parametrize("cutoff_hz", [3.0, 6.0])
@pytest.mark.parametrize("rate", [30, 120])
def test_a_sine_is_attenuated_as_in_theory_and_not_delayed(hz: float, cutoff_hz: float, rate: int) -> None:
    times_s = np.arange(0, 20, 1 / rate)
    sine = np.sin(2 * np.pi * hz * times_s)
    found = lowpass(times_s, sine[:, None], cutoff_hz)[:, 0]
    middle = slice(5 * rate, 15 * rate)
    gain = float(found[middle] @ sine[middle]) / float(sine[middle] @ sine[middle])
    warped = np.tan(np.pi * hz / rate) / np.tan(np.pi * cutoff_hz / rate)
    theory = 1 / (1 + (np.sqrt(2) - 1) * warped**4)  # two passes of order 2, -3 dB at the cut-off
    assert gain == pytest.approx(theory, abs=2e-3)
    np.testing.assert_allclose(found[middle], gain * sine[middle], atol=2e-3)  # no other phase


@pytest.mark.slow
@given(yaw=st.floats(-7, 7), seed=st.integers(0, 100))
@few_examples
def test_it_is_the_same_in_a_turned_world(yaw: float, seed: int) -> None:
    track = gentle(60, seed=seed)
    turn = euler_to_matrix("y", np.array([yaw]))
    turned_angles = track.angles.copy()
    turned_angles[:, NAVEL] += yaw
    turned = replace(track, positions=track.positions @ turn.T, angles=turned_angles)
    out, other = smoothed(track, 4.0), smoothed(turned, 4.0)
    np.testing.assert_allclose(other.positions, out.positions @ turn.T, atol=1e-9)
    np.testing.assert_allclose(rotations(other), turn @ rotations(out), atol=1e-9)
    np.testing.assert_allclose(np.delete(other.angles, NAVEL, 1), np.delete(out.angles, NAVEL, 1), atol=1e-9)


def test_several_turns_about_the_vertical_stay_continuous() -> None:
    track = gentle(300)
    wrapped = track.angles.copy()
    wrapped[:, NAVEL] = (wrapped[:, NAVEL] + np.pi) % (2 * np.pi) - np.pi
    out, other = smoothed(track, 6.0), smoothed(replace(track, angles=wrapped), 6.0)
    np.testing.assert_allclose(rotations(other), rotations(out), atol=1e-9)
    assert np.abs(np.diff(out.angles[:, NAVEL])).max() < 0.2


def test_noise_is_reduced() -> None:
    track, true = gentle(300), gentle(300, noise=0.0)
    out = smoothed(track, 6.0)
    for name in ("positions", "angles"):
        raw, smooth, exact = (getattr(one, name) for one in (track, out, true))
        assert np.std(smooth - exact) < 0.75 * np.std(raw - exact)
        accelerations = [np.std(np.diff(one, 2, axis=0) - np.diff(exact, 2, axis=0)) for one in (raw, smooth)]
        assert accelerations[1] < 0.25 * accelerations[0]


def test_lost_frames_stay_lost_and_divide_the_track() -> None:
    gone = with_gap(gentle(120), range(50, 60))
    out = smoothed(gone, 6.0)
    assert np.isnan(out.positions[50:60]).all()
    assert np.isnan(out.angles[50:60]).all()
    assert out.lost == gone.lost
    for part in (slice(0, 50), slice(60, 120)):
        alone = smoothed(gone.rows(np.arange(120)[part]), 6.0)
        np.testing.assert_array_equal(out.angles[part], alone.angles)
        np.testing.assert_array_equal(out.positions[part], alone.positions)


def test_a_jump_of_the_root_is_not_smeared() -> None:
    track = gentle(120, noise=0.0)
    positions = track.positions.copy()
    positions[60:] += 2.0
    out = smoothed(replace(track, positions=positions), 6.0)
    np.testing.assert_allclose(out.positions[55:65], positions[55:65], atol=0.02)


@pytest.mark.parametrize(
    "track", [*map(gentle, (1, 2, 5, 9)), moving(30, lost=(4,))], ids=["1", "2", "5", "9", "random poses"]
)
def test_short_stretches_and_poses_that_no_person_can_do_are_left_as_they_are(track: PoseTrack) -> None:
    np.testing.assert_array_equal(smoothed(track, 6.0).angles, track.angles)


def test_irregular_times_give_the_same_motion() -> None:
    even, random = gentle(300, rate=60.0, noise=0.0), np.random.default_rng(1)
    times_s = even.times_s + random.uniform(-0.005, 0.005, 300)

    def at_times(values: Floats) -> Floats:
        return np.stack([np.interp(times_s, even.times_s, column) for column in values.T], axis=1)

    uneven = replace(even, times_s=times_s, angles=at_times(even.angles), positions=at_times(even.positions))
    moved = at_times(smoothed(even, 6.0).angles)
    np.testing.assert_allclose(smoothed(uneven, 6.0).angles[20:-20], moved[20:-20], atol=4e-3)


def test_missing_frames_are_bridged_without_new_rows() -> None:
    whole = gentle(200, noise=0.0)
    kept = np.array([row for row in range(200) if row % 7 not in (3, 4)])
    out = smoothed(whole.rows(kept), 6.0)
    np.testing.assert_array_equal(out.frames, kept)
    np.testing.assert_allclose(out.angles[10:-10], whole.angles[kept][10:-10], atol=0.01)


def test_hinges_stay_within_their_limits() -> None:
    track = gentle(120, noise=0.0)
    knee, angles = TEN_PARTS.index["right_knee.x"], track.angles.copy()
    angles[:, knee] = np.where(np.arange(120) % 40 < 20, 0.0, -1.5)
    out = smoothed(replace(track, angles=angles), 4.0)
    assert out.angles[:, knee].max() <= 0.0
    assert out.angles[:, knee].min() < -1.5  # the filter overshoots


@pytest.mark.parametrize("hz", [0.0, -1.0, 0.05, 14.0, 1e9, float("nan"), float("inf")])
def test_a_frequency_that_the_frame_rate_does_not_allow_is_refused(hz: float) -> None:
    with pytest.raises(UserError, match=r"smooth = \S+ Hz: allowed: 0\.1 to 13\.5, 0\.45 of the 30 frames/s"):
        smoothed(gentle(40), hz)


@given(seed=st.integers(0, 1000))
@few_examples
def test_rotations_and_angles_are_inverse(seed: int) -> None:
    track = moving(20, seed=seed)
    found = pose_rotations(TEN_PARTS, track.positions, track.angles)
    np.testing.assert_allclose(joint_angles(TEN_PARTS, found, track.angles), track.angles, atol=1e-6)


def test_stretches_that_are_too_short_are_counted_and_left() -> None:
    cut = with_gap(gentle(60), [4, 40])  # stretches of 4, 35 and 19 frames
    assert too_short(cut, 6.0) == (1, 4)
    assert too_short(cut, 1.0) == (2, 23)  # a period is 30 frames
    out = smoothed(cut, 6.0)
    np.testing.assert_array_equal(out.positions[:4], cut.positions[:4])
    assert not np.allclose(out.positions[5:40], cut.positions[5:40], atol=1e-4)
    assert "1 stretches, 4 frames, too short: unchanged" in description(6.0, (1, 4))
