"""Measures of jitter and pairs: known delays, noise and turns."""

import numpy as np
import pytest

from benchmarks.cases.jitter import jitter_deg, lag_s, track_of, turned_pct, without_t_pose
from benchmarks.people.shared_clips import Instant
from benchmarks.people.simulated_clips import SimulatedClip
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Bdp, Pose
from zenocap.simulation.body.rotation import ry

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


def test_frames_without_a_pose_have_no_delay() -> None:
    times_s = np.arange(150) / RATE
    assert np.isnan(lag_s(np.full((150, 2, 3), np.nan), paths(times_s), RATE))


def test_shoulders_turned_by_more_than_45_degrees_are_counted() -> None:
    true = np.tile([[0.2, 1.4, 0.0], [-0.2, 1.4, 0.0]], (5, 1, 1))
    turns = [ry(np.radians(degrees)).T for degrees in (0, 40, -50, 170, np.nan)]
    found = np.array([points @ turn for points, turn in zip(true, turns, strict=True)])
    assert turned_pct(found, true) == pytest.approx(40.0)


def test_without_a_t_pose_a_clip_begins_with_the_motion_and_is_scored_later() -> None:
    instants = tuple(Instant(k, round(k * 1e9 / RATE), {}) for k in range(30, 200))
    clip = without_t_pose(SimulatedClip({}, instants, None, 90, round(1e9 / RATE)))
    assert clip.instants[0].frame == 90
    assert clip.motion_from == 90 + 45
