"""Measures of jitter: known delays and known noise."""

import numpy as np
import pytest

from benchmarks.cases.jitter import jitter_deg, lag_s, track_of
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Bdp, Pose

RATE = 30.0
BODY = Bdp(np.zeros((len(FOURTEEN_PARTS.parts), 3)), np.zeros((len(FOURTEEN_PARTS.joints), 3)))


def paths(times_s: np.ndarray) -> np.ndarray:
    """(n, 2, 3) two joints that move like a walking person's."""
    return np.stack(
        [np.stack([np.sin(4 * times_s + k), np.cos(3 * times_s), 0.5 * times_s], axis=1) for k in (0, 1)], axis=1
    )


@pytest.mark.parametrize("delay_frames", [-3.0, 0.0, 0.4, 2.5, 6.0])
def test_a_known_delay_is_found_between_frames_and_with_lost_ones(delay_frames: float) -> None:
    times_s = np.arange(150) / RATE
    found = paths(times_s - delay_frames / RATE)
    found[60:70] = np.nan
    assert lag_s(found, paths(times_s), RATE) * RATE == pytest.approx(delay_frames, abs=0.05)


def test_jitter_is_that_of_the_noise() -> None:
    random, noise = np.random.default_rng(0), 0.01
    angles = FOURTEEN_PARTS.neutral + np.zeros((400, len(FOURTEEN_PARTS.angles)))
    hinges = [
        FOURTEEN_PARTS.index[f"{side}_{joint}.x"] for side in ("left", "right") for joint in ("elbow", "knee", "ankle")
    ]
    angles[:, hinges] += noise * random.standard_normal((400, len(hinges)))
    track = track_of(BODY, list(range(400)), [Pose(np.zeros(3), row) for row in angles], RATE)
    still, step = jitter_deg(track, 0)
    joints = sum(bool(joint.axes) for joint in FOURTEEN_PARTS.joints)
    assert still == pytest.approx(np.degrees(noise) * np.sqrt(len(hinges) / joints), rel=0.05)
    assert step == pytest.approx(np.sqrt(2) * still, rel=0.05)
