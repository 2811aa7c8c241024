"""Postures of a take for the page, in seconds of the player."""

from pathlib import Path

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.recording.summary import Summary, read_summary
from zenocap.services.animator.page.page_messages import PosturePart, PosturesUpdate
from zenocap.services.animator.take_marks import postures_update


def posture(label: str | None, start_s: float, end_s: float) -> m.Posture:
    start_ns, end_ns = (START_NS + round(1e9 * time_s) for time_s in (start_s, end_s))
    return m.Posture(
        frame=0, captured_ns=end_ns, label=label, start_ns=start_ns, end_ns=end_ns, log_likelihoods={}, score=1.0,
        margin=0.0,
    )  # fmt: skip


def summary_of(take: Path) -> Summary:
    summary = read_summary(take)
    assert summary is not None
    return summary


def test_named_postures_have_their_place_in_the_take(tmp_path: Path) -> None:
    found = [posture("squat", 1.0, 2.5), posture(None, 2.5, 3.0), posture("raise-right-arm", 3.0, 4.0)]
    take = write_take(tmp_path / "a.mcap", [*messages_of_track(moving(20)), *found])
    expected = [PosturePart(1.0, 2.5, "squat"), PosturePart(3.0, 4.0, "raise-right-arm")]
    assert postures_update(take, summary_of(take), lambda: False) == PosturesUpdate(expected)
    assert postures_update(take, summary_of(take), lambda: True) == PosturesUpdate([])


def test_a_take_without_postures_has_none(tmp_path: Path) -> None:
    take = write_take(tmp_path / "a.mcap", messages_of_track(moving(20)))
    assert postures_update(take, summary_of(take), lambda: False) == PosturesUpdate([])
