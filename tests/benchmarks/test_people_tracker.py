"""The tracker over a clip and its errors: lost frames, angles, recovery, priors."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.cases.clips import CLIPS, mediapipe
from benchmarks.people import tracker
from zenocap.common.body.definition import neutral_pose
from zenocap.common.formats.trajectories import Trajectories
from zenocap.services.tracker.body.average_body import body_of_height
from zenocap.tools.takes.evaluate import ScoredFrames, accuracy

NAN = float("nan")
FRAMES, RATE = range(40), 60.0


def path_of(frames: Iterable[int], shift: float = 0.0) -> tracker.TrackedPath:
    body = body_of_height(1.75)
    poses = {k: (body, neutral_pose(tracker.ANATOMY, np.array([shift, 0.9, 0.01 * k]), yaw=0.02 * k)) for k in frames}
    return tracker.TrackedPath(poses, (4,))


def truth_of(frames: Iterable[int]) -> Trajectories:
    return tracker.trajectories(path_of(frames), RATE)


def marching() -> tracker.TrackedPath:
    """Knees, hips and elbows that flex by up to 60 degrees."""
    body, poses = body_of_height(1.75), {}
    for k in FRAMES:
        pose = neutral_pose(tracker.ANATOMY, np.array([0.0, 0.9, 0.01 * k]))
        angles = pose.angles.copy()
        for joint, sign in (("knee", 1.0), ("hip", -1.0), ("elbow", -1.0)):
            for side, phase in (("left", 0.0), ("right", 2.0)):
                angles[tracker.ANATOMY.index[f"{side}_{joint}.x"]] = sign * (0.6 + 0.4 * np.sin(0.3 * k + phase))
        poses[k] = body, replace(pose, angles=angles)
    return tracker.TrackedPath(poses)


def test_frames_without_a_pose_are_lost() -> None:
    path, truth = path_of([3, 4, 6, 7], 0.03), truth_of(range(10))
    found = tracker.errors(path, truth, 2)
    assert found["mean"] == pytest.approx(30.0)
    assert (found["lost"], found["losses"], found["first pose"]) == (pytest.approx(50.0), 1, 3.0)
    frames, distances = tracker.frame_errors(path, truth)
    assert frames[np.isnan(distances)].tolist() == [0, 1, 2, 5, 8, 9]


def test_a_path_without_any_pose_is_completely_lost() -> None:
    assert tracker.errors(tracker.TrackedPath({}), truth_of(range(10)), 2) == {"lost": 100.0, "losses": 1}
    assert tracker.errors(path_of([0, 1]), truth_of(range(10)), 2) == {"first pose": 0.0, "lost": 100.0, "losses": 1}
    with pytest.raises(ValueError, match="without a pose from frame 2 on"):
        tracker.trajectories(path_of([0, 1]), RATE, 2)


def test_errors_by_frame_have_the_scorers_mean() -> None:
    path, truth = path_of(range(4), 0.05), truth_of(range(4))
    assert tracker.frame_errors(path, truth)[1].mean() == pytest.approx(
        accuracy(tracker.trajectories(path, RATE), truth, ScoredFrames()).mpjpe_mm
    )


@pytest.mark.parametrize(
    ("distances", "in_row", "expected"),
    [
        ((30.0, 20.0), 1, 1),
        ((90.0, 50.0, 49.9), 1, 3),
        ((NAN, 90.0), 1, NAN),
        ((), 1, NAN),
        ((90.0, 20.0, 90.0, 20.0, 20.0, 20.0), 2, 4),
        ((90.0, 20.0, 90.0, 20.0, 20.0, 20.0), 4, NAN),
    ],
)
def test_frames_until_the_error_is_small_for_a_while(distances: tuple[float, ...], in_row: int, expected: float) -> None:
    frames = np.arange(100, 103 + len(distances))
    found = tracker.frames_until(frames, np.array([20.0, NAN, NAN, *distances]), 103, 50.0, in_row)
    assert found == pytest.approx(expected, nan_ok=True)


def test_equal_centres_have_equal_angles() -> None:
    centres = tracker.trajectories(marching(), RATE)
    found = tracker.angle_errors(tracker.centre_angles(centres), tracker.centre_angles(centres), 0)
    assert found["knee_flexion_r"].range_truth_deg > 30.0
    for name in ("knee_flexion", "hip_flexion", "elbow_flexion", "shoulder_elevation"):
        assert max(tracker.of_sides(found, name)) < 1e-6
    assert np.isnan(tracker.of_sides(found, "ankle_dorsiflexion")).all()  # centres without toes


def test_a_constant_offset_is_removed_from_the_second_figure_only() -> None:
    path = marching()
    series = tracker.pose_angles(path, RATE, 0)
    shifted = {name: values + 10.0 * (name == "knee_flexion_r") for name, values in series.angles.items()}
    found = tracker.angle_errors(series, replace(series, angles=shifted), 0)
    assert found["knee_flexion_r"].rms_deg == pytest.approx(10.0)
    assert found["ankle_dorsiflexion_l"].rms_deg == pytest.approx(0.0, abs=1e-6)
    assert tracker.of_sides(found, "knee_flexion") == pytest.approx((10.0 / np.sqrt(2), 0.0), abs=1e-6)  # of both sides
    assert tracker.of_sides(found, "hip_flexion") == pytest.approx((0.0, 0.0), abs=1e-6)


def test_angles_have_gaps_where_there_is_no_pose() -> None:
    series = tracker.pose_angles(path_of([2, 4]), RATE, 2)
    assert series.known.tolist() == [True, False, True]


def test_mediapipe_figures_are_read_from_their_table(tmp_path: Path) -> None:
    path = tmp_path / "mediapipe.md"
    path.write_text(
        "# M\n| clip | mean | RMSE | shape | lost |\n|---|---|---|---|---|\n| real, against `r` | 99.2 | 142.1 | 1 | 2 |\n"
        "| kick2 (new) | 26.8 | 30.6 | 20.6 | 17.8 |\n"
    )
    assert mediapipe(path) == {"real": (99.2, 142.1, 1.0, 2.0), "kick2": (26.8, 30.6, 20.6, 17.8)}
    assert mediapipe(tmp_path / "none.md") == {}


def test_clips_are_tracked_by_all_views_and_both_ways() -> None:
    assert {one.option("views", 2) for one in CLIPS.cases.values()} == {7, 4, 3, 2}
    assert sum(one.option("both_ways", False) for one in CLIPS.cases.values()) == len(CLIPS.cases) // 2
