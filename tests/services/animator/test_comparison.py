"""Comparison of two takes: pairing, distances, takes that cannot be compared."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.pose_tracks import body, moving
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.services.animator.comparison import TakeComparison, TimedTrack
from zenocap.services.animator.comparison_reader import compare
from zenocap.services.animator.states import ActorPose

RATE = 20.0
MOVED_M = np.array([0.3, 0.0, -0.4])  # by 0.5 m


ONE = moving(10, rate=RATE)


def timed(track: PoseTrack = ONE, name: str = "a.mcap", start_ns: int = START_NS) -> TimedTrack:
    return TimedTrack(name, start_ns + np.round(track.times_s * 1e9).astype(np.int64), track)


def actor(timed: TimedTrack, row: int, shift_ns: int = 0) -> ActorPose:
    track = timed.track
    captured_ns = int(timed.captured_ns[row]) + shift_ns
    return ActorPose(
        row, captured_ns, 0, "two-view", track.anatomy, track.bdp, track.pose(row), tuple(track.lost[row].split())
    )


@pytest.mark.parametrize("shift_ns", [0, 77_000_000_123])
def test_every_joint_of_a_moved_copy_is_as_far_away_as_it_was_moved(shift_ns: int) -> None:
    other = timed(replace(ONE, positions=ONE.positions + MOVED_M), "b.mcap")
    comparison = TakeComparison(timed(), other)
    found = comparison.at(actor(timed(), 4, shift_ns), shift_ns)
    assert list(found.distances) == [marker.name for marker in ONE.anatomy.markers]
    assert list(found.distances.values()) == pytest.approx([0.5] * len(found.distances))
    expected = joint_centres(ONE.anatomy, ONE.bdp, other.track.pose(4))
    assert found.pose.centres == pytest.approx(expected.ravel().tolist(), abs=6e-4)
    assert comparison.alignment == "aligned by recorded times"


@pytest.mark.parametrize(
    ("offset_s", "row", "text"), [(0.0, 5, ""), (0.1, 3, ", shown 0.1 s later"), (-0.1, 7, ", shown 0.1 s earlier")]
)
def test_takes_of_other_times_are_aligned_at_their_first_poses_and_moved_by_the_offset(
    offset_s: float, row: int, text: str
) -> None:
    comparison = TakeComparison(timed(), timed(ONE, "b.mcap", START_NS + 10**12), offset_s)
    assert comparison.at(actor(timed(), 5), 0).pose.frame == row
    assert comparison.alignment == f"aligned at the first poses{text}"


def test_a_take_is_at_no_distance_from_itself_also_where_its_body_was_still_another() -> None:
    early = replace(actor(timed(), 4), body=body(1.6))
    assert set(TakeComparison(timed(), timed()).at(early, 0).distances.values()) == {0.0}


def test_there_is_no_pose_beyond_the_end_of_the_second_take_or_where_its_person_is_lost() -> None:
    short = TakeComparison(timed(), timed(moving(5, rate=RATE, lost=(2,)), "b.mcap"))
    found = [short.at(actor(timed(), row), 0) for row in (1, 2, 4, 5, 6, 9)]
    assert [one.pose is not None for one in found] == [True, False, True, True, False, False]
    assert found[1].distances == {}


def test_a_pose_whose_time_is_not_known_yet_is_not_compared() -> None:
    comparison = TakeComparison(timed(), timed())
    assert comparison.at(actor(timed(), 4), 1_000) is None  # no recorded time
    assert comparison.at(actor(timed(), 4, 50_000_000), 0) is None  # that of another pose


def test_takes_that_cannot_be_compared_are_refused(tmp_path: Path) -> None:
    take = write_take(tmp_path / "a.mcap", messages_of_track(moving(5, rate=RATE)))
    write_take(tmp_path / "empty.mcap", messages_of_track(moving(5, rate=RATE))[:2])
    (tmp_path / "text.mcap").write_text("not a take")
    assert compare(take, take).body().take == "a.mcap"
    for name, text in (("empty.mcap", "no universal BAP"), ("text.mcap", "no MCAP file"), ("x", "no such file")):
        with pytest.raises(UserError, match=f"{tmp_path / name}.*{text}"):
            compare(take, tmp_path / name)
