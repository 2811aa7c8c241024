"""Figures of the fault table, computed from received messages."""

from hypothesis import given
from hypothesis import strategies as st

from benchmarks.faults.measures import SETTLED, ReceivedMessage, Window, figures, missing_frames, recovery_ns

S = 1_000_000_000
FPS = 10.0
STEP = S // 10
WINDOW = Window(10 * S, 14 * S, 20 * S)


def pose(frame: int, missing_viewers: tuple[str, ...] = ()) -> ReceivedMessage:
    return ReceivedMessage(frame * STEP, "universal_bap", "integrator main", frame, frame * STEP, missing_viewers)


def sighting(viewer: str, frame: int) -> ReceivedMessage:
    return ReceivedMessage(frame * STEP, "sighting", f"viewer {viewer}", frame, frame * STEP)


def viewer_2_absent(first: int, last: int) -> list[ReceivedMessage]:
    """Twenty seconds without messages of viewer 2 from frame `first` to `last`; the others continue."""
    events: list[ReceivedMessage] = []
    for frame in range(200):
        absent = first <= frame <= last
        events += [sighting("1", frame), *([] if absent else [sighting("2", frame)]), pose(frame, ("2",) if absent else ())]
    return events


def test_absent_viewer_loses_only_its_own_frames() -> None:
    found = figures(viewer_2_absent(100, 144), WINDOW, FPS, ["2"])
    assert (found.poses, found.whole, found.others) == (1.0, 0.0, 1.0)
    assert found.recovered_s == 0.5
    assert found.gap_s == 0.1
    assert (found.lost, found.after_lost) == ({"2": 45}, 0)


def test_gap_is_the_time_without_poses() -> None:
    events = [event for event in viewer_2_absent(100, 144) if event.topic != "universal_bap" or not event.missing_viewers]
    found = figures(events, WINDOW, FPS, ["2"])
    assert (found.poses, found.gap_s, found.recovered_s) == (0.0, 4.6, 0.5)


def test_viewer_that_does_not_return_has_no_recovery_time() -> None:
    found = figures(viewer_2_absent(100, 199), WINDOW, FPS, ["2"])
    assert found.recovered_s is None
    assert figures([], WINDOW, FPS, []).gap_s == 10.0


@given(st.integers(141, 190))
def test_incomplete_pose_restarts_the_count_of_consecutive_poses(incomplete: int) -> None:
    events = [pose(frame, ("2",) if frame == incomplete else ()) for frame in range(200)]
    recovered = recovery_ns(events, WINDOW)
    assert recovered == (14 * S if incomplete >= 140 + SETTLED else (incomplete + 1) * STEP)


def test_frames_are_missing_at_gaps_in_the_frame_numbers() -> None:
    events = [sighting("1", frame) for frame in range(200) if frame % 50]
    assert missing_frames(events, "1", WINDOW) == [10 * S, 15 * S]
    assert missing_frames(events, "2", WINDOW) == []
