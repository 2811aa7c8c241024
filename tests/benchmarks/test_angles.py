"""Angle errors of the evaluation: none against the same poses; a known offset is found."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hybrid.angles import (
    angle_cells,
    centre_angles,
    errors_against_angles,
    errors_against_centres,
    run_angles,
)
from benchmarks.hybrid.runs import ANATOMY, NAMES, Run, TrackedPath, scored, trajectories
from zenocap.common.body.definition import neutral_pose
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import body_of_height

FRAMES, RATE = range(40), 60.0


def marching() -> TrackedPath:
    """Knees, hips and elbows that flex by up to 60 degrees."""
    body, poses = body_of_height(1.75), {}
    for k in FRAMES:
        pose = neutral_pose(ANATOMY, np.array([0.0, 0.9, 0.01 * k]))
        angles = pose.angles.copy()
        for joint, sign in (("knee", 1.0), ("hip", -1.0), ("elbow", -1.0)):
            for side, phase in (("left", 0.0), ("right", 2.0)):
                angles[ANATOMY.index[f"{side}_{joint}.x"]] = sign * (0.6 + 0.4 * np.sin(0.3 * k + phase))
        poses[k] = body, replace(pose, angles=angles)
    return TrackedPath(poses, (), dict.fromkeys(FRAMES, 1.0), dict.fromkeys(FRAMES, 1.0))


def centres(path: TrackedPath) -> Trajectories:
    frames = np.array(sorted(path.poses))
    rate_only = Trajectories(NAMES, frames, frames / RATE, np.zeros((0, len(NAMES), 3)), RATE)
    return trajectories(path, rate_only)


def test_equal_centres_have_equal_angles() -> None:
    path = marching()
    run = scored(path, centres(path), 0)
    errors = errors_against_centres(run, centre_angles(centres(path)))
    assert errors["knee_flexion_r"].range_truth_deg > 30.0
    for name in ("knee_flexion", "hip_flexion", "elbow_flexion", "shoulder_elevation"):
        assert max(errors[f"{name}_{side}"].rms_deg for side in "rl") < 0.3
    assert not any(name.startswith("ankle") for name in errors)  # centres without toes


def test_a_constant_offset_is_removed_from_the_second_figure_only() -> None:
    path = marching()
    run = scored(path, centres(path), 0)
    series = run_angles(run, RATE)
    shifted = {name: values + 10.0 * (name == "knee_flexion_r") for name, values in series.angles.items()}
    errors = errors_against_angles(run, replace(series, angles=shifted))
    assert errors["knee_flexion_r"].rms_deg == pytest.approx(10.0)
    assert errors["ankle_dorsiflexion_l"].rms_deg == pytest.approx(0.0, abs=1e-6)
    knee, hip, *_ = angle_cells([errors, {}])  # the second seed has no pose
    assert knee == "7.1 / 0.0"  # root mean square of both sides
    assert hip == "0.0 / 0.0"


def test_without_a_pose_there_is_no_angle() -> None:
    nan = float("nan")
    run = Run(nan, nan, nan, nan, 100.0, {}, 1, -1, nan, nan, 0.0, 0, ())
    assert errors_against_centres(run, centre_angles(centres(marching()))) == {}
    assert set(angle_cells([{}])) == {"–"}
