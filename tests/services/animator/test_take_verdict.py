"""Verdict of a take for the page: parts of equal class, in seconds of the player."""

from pathlib import Path

import pytest

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.services.animator.page.page_messages import VerdictPart, VerdictUpdate
from zenocap.services.animator.take_marks import verdict_update

SECOND_NS = 1_000_000_000


def stretch(number: int, rating: m.Rating, error: float, *reasons: str) -> m.VerdictStretch:
    start_ns = START_NS + number * SECOND_NS
    return m.VerdictStretch(
        start_ns=start_ns, end_ns=start_ns + SECOND_NS, rating=rating, error=error, lost=0.0, reasons=list(reasons)
    )


def test_stretches_of_equal_class_in_a_row_are_one_part(tmp_path: Path) -> None:
    verdict = m.Verdict(
        frame=0,
        captured_ns=START_NS + SECOND_NS,
        rating="doubtful",
        error=0.08,
        evidence="one-pass",
        reasons=[m.VerdictReason(kind="cut", text="the person is cut")],
        stretches=[
            stretch(1, "good", 0.04),
            stretch(2, "good", 0.06, "limbs"),
            stretch(3, "unusable", 0.2, "cut", "limbs"),
            stretch(4, "good", 0.05),
        ],
    )
    take = write_take(tmp_path / "a.mcap", [*messages_of_track(moving(20)), verdict])
    assert verdict_update(take) == VerdictUpdate(
        "doubtful",
        ["the person is cut"],
        [
            VerdictPart(1.0, 3.0, "good", pytest.approx(0.05), ["limbs"]),
            VerdictPart(3.0, 4.0, "unusable", 0.2, ["cut", "limbs"]),
            VerdictPart(4.0, 5.0, "good", 0.05, []),
        ],
    )


def test_a_take_without_verdict_or_that_is_cut_has_no_parts(tmp_path: Path) -> None:
    take = write_take(tmp_path / "a.mcap", messages_of_track(moving(20)))
    assert verdict_update(take) == VerdictUpdate()
    take.write_bytes(take.read_bytes()[:-200])
    assert verdict_update(take) == VerdictUpdate()
    assert verdict_update(tmp_path / "none.mcap") == VerdictUpdate()
