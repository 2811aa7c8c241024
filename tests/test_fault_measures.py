"""What the table of faults says is what was heard."""

from hypothesis import given
from hypothesis import strategies as st

from tests.evaluation.faults.measures import SETTLED, Heard, Window, figures, missing_frames, recovery_ns

S = 1_000_000_000
FPS = 10.0
STEP = S // 10
WINDOW = Window(10 * S, 14 * S, 20 * S)


def pose(frame: int, without: tuple[str, ...] = ()) -> Heard:
    return Heard(frame * STEP, "universal_bap", "integrator main", frame, frame * STEP, without)


def sighting(viewer: str, frame: int) -> Heard:
    return Heard(frame * STEP, "sighting", f"viewer {viewer}", frame, frame * STEP)


def viewer_2_away(first: int, last: int) -> list[Heard]:
    """Twenty seconds in which viewer 2 says nothing from frame `first` to `last`, and the others go on."""
    events: list[Heard] = []
    for frame in range(200):
        away = first <= frame <= last
        events += [sighting("1", frame), *([] if away else [sighting("2", frame)]), pose(frame, ("2",) if away else ())]
    return events


def test_a_viewer_that_was_away_costs_its_own_frames_alone() -> None:
    found = figures(viewer_2_away(100, 144), WINDOW, FPS, ["2"])
    assert (found.poses, found.whole, found.others) == (1.0, 0.0, 1.0)
    assert found.recovered_s == 0.5
    assert found.gap_s == 0.1
    assert (found.lost, found.after_lost) == ({"2": 45}, 0)


def test_without_poses_the_gap_is_as_long_as_they_were_missing() -> None:
    events = [event for event in viewer_2_away(100, 144) if event.topic != "universal_bap" or not event.without]
    found = figures(events, WINDOW, FPS, ["2"])
    assert (found.poses, found.gap_s, found.recovered_s) == (0.0, 4.6, 0.5)


def test_who_never_comes_back_has_not_recovered() -> None:
    found = figures(viewer_2_away(100, 199), WINDOW, FPS, ["2"])
    assert found.recovered_s is None
    assert figures([], WINDOW, FPS, []).gap_s == 10.0


@given(st.integers(141, 190))
def test_one_pose_that_is_not_whole_begins_the_row_anew(bad: int) -> None:
    events = [pose(frame, ("2",) if frame == bad else ()) for frame in range(200)]
    recovered = recovery_ns(events, WINDOW)
    assert recovered == (14 * S if bad >= 140 + SETTLED else (bad + 1) * STEP)


def test_frames_are_missing_where_numbers_are() -> None:
    events = [sighting("1", frame) for frame in range(200) if frame % 50]
    assert missing_frames(events, "1", WINDOW) == [10 * S, 15 * S]
    assert missing_frames(events, "2", WINDOW) == []
