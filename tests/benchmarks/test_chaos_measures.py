"""Figures of a fault, computed from what an observer received."""

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.chaos.measures import FaultWindow, figures, missing_frames, recovery_ns
from benchmarks.chaos.observer import SETTLED, SeenFrame, SeenPose

S = 1_000_000_000
FPS = 10.0
STEP = S // 10
WINDOW = FaultWindow(10 * S, 14 * S, 20 * S)


def pose(frame: int, views: int = 2) -> SeenPose:
    return SeenPose(frame * STEP, frame * STEP, frame, False, views)


def frames(absent: range = range(0)) -> list[SeenFrame]:
    """Twenty seconds of a viewer, without frames of `absent`."""
    return [SeenFrame(frame * STEP, frame * STEP, frame) for frame in range(200) if frame not in absent]


def poses(absent: range) -> list[SeenPose]:
    return [pose(frame, 1 if frame in absent else 2) for frame in range(200)]


def test_absent_viewer_loses_only_its_own_frames() -> None:
    absent = range(100, 145)
    found = figures(poses(absent), {"1": frames(), "2": frames(absent)}, WINDOW, FPS, ["2"])
    assert (found["poses"], found["whole"], found["others"]) == (100.0, 0.0, 100.0)
    assert found["recovered"] == 0.5
    assert found["gap"] == 0.1
    assert (found["lost"], found["other lost"]) == (45, 0)


def test_gap_is_the_time_without_poses() -> None:
    absent = range(100, 145)
    whole = [one for one in poses(absent) if one.views == 2]
    found = figures(whole, {"1": frames(), "2": frames(absent)}, WINDOW, FPS, ["2"])
    assert (found["poses"], found["gap"], found["recovered"]) == (0.0, 4.6, 0.5)


def test_viewer_that_does_not_return_has_no_recovery_time() -> None:
    absent = range(100, 200)
    assert "recovered" not in figures(poses(absent), {"1": frames(), "2": frames(absent)}, WINDOW, FPS, ["2"])
    assert figures([], {}, WINDOW, FPS)["gap"] == 11.0  # from a second before the fault on


@given(st.integers(141, 190))
def test_incomplete_pose_restarts_the_count_of_consecutive_poses(incomplete: int) -> None:
    events = [pose(frame, 1 if frame == incomplete else 2) for frame in range(200)]
    recovered = recovery_ns(events, WINDOW, 2)
    assert recovered == (14 * S if incomplete >= 140 + SETTLED else (incomplete + 1) * STEP)


def test_frames_are_missing_at_gaps_in_the_frame_numbers() -> None:
    seen = [one for one in frames() if one.frame % 50]
    assert missing_frames(seen, WINDOW) == [10 * S, 15 * S]
    assert missing_frames([], WINDOW) == []
