"""Verdict and postures of a take for the page, in seconds of the player."""

from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.recording.summary import read_summary
from zenocap.services.animator.page.page_messages import PosturePart, PosturesUpdate, VerdictPart, VerdictUpdate
from zenocap.services.animator.take_marks import postures_update, verdict_update


def at(time_s: float) -> int:
    return START_NS + round(1e9 * time_s)


def take_with(folder: Path, *messages: m.Message) -> Path:
    return write_take(folder / "a.mcap", [*messages_of_track(moving(20)), *messages])


def posture(label: str | None, start_s: float, end_s: float) -> m.Posture:
    return built(m.Posture, captured_ns=at(end_s), label=label, start_ns=at(start_s), end_ns=at(end_s))


def stretch(second: int, rating: m.Rating, error: float, *reasons: str) -> m.VerdictStretch:
    return m.VerdictStretch(
        start_ns=at(second), end_ns=at(second + 1), rating=rating, error=error, lost=0.0, reasons=list(reasons)
    )


def test_named_postures_have_their_place_in_the_take(tmp_path: Path) -> None:
    take = take_with(tmp_path, posture("squat", 1.0, 2.5), posture(None, 2.5, 3.0), posture("raise-right-arm", 3.0, 4.0))
    expected = [PosturePart(1.0, 2.5, "squat"), PosturePart(3.0, 4.0, "raise-right-arm")]
    assert postures_update(take, read_summary(take), lambda: False) == PosturesUpdate(expected)
    assert postures_update(take, read_summary(take), lambda: True) == PosturesUpdate([])


def test_stretches_of_equal_class_in_a_row_are_one_part(tmp_path: Path) -> None:
    stretches = [
        stretch(1, "good", 0.04), stretch(2, "good", 0.06, "limbs"), stretch(3, "unusable", 0.2, "cut", "limbs"),
        stretch(4, "good", 0.05),
    ]  # fmt: skip
    reasons = [m.VerdictReason(kind="cut", text="the person is cut")]
    verdict = built(m.Verdict, captured_ns=at(1), rating="doubtful", error=0.08, reasons=reasons, stretches=stretches)
    parts = [
        VerdictPart(1.0, 3.0, "good", pytest.approx(0.05), ["limbs"]),
        VerdictPart(3.0, 4.0, "unusable", 0.2, ["cut", "limbs"]),
        VerdictPart(4.0, 5.0, "good", 0.05, []),
    ]
    assert verdict_update(take_with(tmp_path, verdict)) == VerdictUpdate("doubtful", ["the person is cut"], parts)


def test_a_take_without_marks_or_that_is_cut_has_no_parts(tmp_path: Path) -> None:
    take = take_with(tmp_path)
    assert postures_update(take, read_summary(take), lambda: False) == PosturesUpdate([])
    assert verdict_update(take) == VerdictUpdate()
    take.write_bytes(take.read_bytes()[:-200])
    assert verdict_update(take) == VerdictUpdate()
    assert verdict_update(tmp_path / "none.mcap") == VerdictUpdate()
