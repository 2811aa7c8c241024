"""One Euro filter of poses: gain and phase of theory, equal in every world, restarts."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.common.formats.test_smoothing import NAVEL, gentle
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.one_euro import MAX_GAP_NS, Filtered, OneEuro, filtered
from zenocap.common.body.rotations import euler_to_matrix

RATE = 30.0
KNEE = TEN_PARTS.index["right_knee.x"]
few_examples = settings(max_examples=20)


def run(poses: Sequence[Pose], options: OneEuro, times_s: Floats | None = None) -> list[Pose]:
    last: Filtered | None = None
    found = []
    for k, pose in enumerate(poses):
        captured_ns = round(1e9 * (k / RATE if times_s is None else times_s[k]))
        last, smooth = filtered(TEN_PARTS, options, last, captured_ns, pose)
        found.append(smooth)
    return found


def poses_of(positions: Floats, angles: Floats) -> list[Pose]:
    return [Pose(position, row) for position, row in zip(positions, angles, strict=True)]


def swinging(hz: float, times_s: Floats) -> list[Pose]:
    """Position along X, the root about the vertical, the neck and a knee: all of them cos(2 pi hz t) / 5 and constants."""
    wave = 0.2 * np.cos(2 * np.pi * hz * times_s)
    angles = np.tile(TEN_PARTS.neutral, (len(times_s), 1))
    angles[:, NAVEL] += 3.0 + wave
    angles[:, TEN_PARTS.index["neck.x"]] += wave
    angles[:, KNEE] = wave - 0.5
    return poses_of(np.stack([wave, np.ones(len(wave)), np.zeros(len(wave))], axis=1), angles)


@pytest.mark.nightly
@pytest.mark.parametrize("hz", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize(("cutoff_hz", "rate"), [(1.5, 30.0), (5.0, 30.0), (3.0, 15.0), (3.0, 60.0)])
def test_gain_and_delay_of_a_sine_are_those_of_theory_at_any_rate(hz: float, cutoff_hz: float, rate: float) -> None:
    times_s = np.arange(0, 12, 1 / rate)
    found = run(swinging(hz, times_s), OneEuro(cutoff_hz, 0.0), times_s)
    alpha = 1 / (1 + rate / (2 * np.pi * cutoff_hz))
    response = alpha / (1 - (1 - alpha) * np.exp(-2j * np.pi * hz / rate))
    expected = 0.2 * np.real(response * np.exp(2j * np.pi * hz * times_s))
    late = times_s >= 5.0
    for values, middle in (
        ([pose.position[0] for pose in found], 0.0),
        ([pose.angles[NAVEL] for pose in found], 3.0),
        ([pose.angles[TEN_PARTS.index["neck.x"]] for pose in found], 0.0),
        ([pose.angles[KNEE] for pose in found], -0.5),
    ):
        np.testing.assert_allclose(np.array(values)[late] - middle, expected[late], atol=1e-6)


@pytest.mark.nightly
def test_faster_motion_is_delayed_less() -> None:
    times_s = np.arange(0, 8, 1 / RATE)
    lags = []
    for amplitude in (0.02, 0.2, 2.0):
        wave = amplitude * np.sin(2 * np.pi * times_s)
        positions = np.stack([wave, np.ones(len(wave)), np.zeros(len(wave))], axis=1)
        found = run(poses_of(positions, np.tile(TEN_PARTS.neutral, (len(wave), 1))), OneEuro(1.5, 4.0))
        smooth = np.array([pose.position[0] for pose in found])[60:]
        phase = np.angle(smooth @ np.exp(-2j * np.pi * times_s[60:])) - np.angle(
            wave[60:] @ np.exp(-2j * np.pi * times_s[60:])
        )
        lags.append(-phase / (2 * np.pi))
    assert 0.09 > lags[0] > lags[1] > lags[2] > 0
    assert lags[2] < 0.02


@pytest.mark.slow
def test_a_person_at_rest_is_unchanged_and_noise_is_reduced() -> None:
    rest = [Pose(np.array([1.0, 0.9, -2.0]), TEN_PARTS.neutral)] * 60
    for pose in run(rest, OneEuro()):
        np.testing.assert_allclose(pose.position, rest[0].position, atol=1e-12)
        np.testing.assert_allclose(pose.angles, rest[0].angles, atol=1e-9)
    random = np.random.default_rng(0)
    noisy = [
        Pose(p.position + 0.004 * random.standard_normal(3), p.angles + 0.01 * random.standard_normal(len(p.angles)))
        for p in rest
    ]
    smooth = run(noisy, OneEuro())[20:]
    assert np.std([pose.position - rest[0].position for pose in smooth]) < 0.5 * 0.004
    assert np.std([pose.angles - rest[0].angles for pose in smooth]) < 0.5 * 0.01


@pytest.mark.nightly
@given(yaw=st.floats(-7, 7), seed=st.integers(0, 100))
@few_examples
def test_it_is_the_same_in_a_turned_world(yaw: float, seed: int) -> None:
    track = gentle(40, seed=seed, noise=0.01)
    turn = euler_to_matrix("y", np.array([yaw]))
    angles = track.angles.copy()
    angles[:, NAVEL] += yaw
    found = run(poses_of(track.positions, track.angles), OneEuro())
    other = run(poses_of(track.positions @ turn.T, angles), OneEuro())
    for one, turned in zip(found, other, strict=True):
        np.testing.assert_allclose(turned.position, turn @ one.position, atol=1e-9)
        roots = [euler_to_matrix("yxz", pose.angles[NAVEL : NAVEL + 3]) for pose in (one, turned)]
        np.testing.assert_allclose(roots[1], turn @ roots[0], atol=1e-9)
        np.testing.assert_allclose(np.delete(turned.angles, NAVEL), np.delete(one.angles, NAVEL), atol=1e-9)


@pytest.mark.slow
def test_wrapped_angles_give_no_jump() -> None:
    track = gentle(200, noise=0.0)
    wrapped = track.angles.copy()
    wrapped[:, NAVEL] = (wrapped[:, NAVEL] + np.pi) % (2 * np.pi) - np.pi
    found = run(poses_of(track.positions, wrapped), OneEuro())
    heading = np.unwrap([pose.angles[NAVEL] for pose in found])
    assert np.abs(np.diff(heading)).max() < 0.1
    assert np.abs(heading - np.unwrap(wrapped[:, NAVEL])).max() < 0.2


@pytest.mark.parametrize("what", ["gap", "jump", "turn", "back"])
def test_it_starts_again_after_a_gap_a_jump_and_a_time_that_does_not_rise(what: str) -> None:
    poses = [Pose(np.array([0.0, 0.9, 0.02 * k]), TEN_PARTS.neutral.copy()) for k in range(11)]
    times_s = np.arange(11) / RATE
    times_s[10] = {"gap": times_s[10] + MAX_GAP_NS / 1e9, "back": times_s[9]}.get(what, times_s[10])
    poses[10].position[:] += 1.0 if what == "jump" else 0.0
    poses[10].angles[NAVEL] += np.pi if what == "turn" else 0.0
    assert run(poses, OneEuro(), times_s)[-1] is poses[10]
