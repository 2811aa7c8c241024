"""Postures of a take by time, and the captions with them."""

from pathlib import Path

from tests.common.formats.test_take_poses import START_NS, messages_of_track, write_take
from tests.support.built_messages import built
from tests.support.pose_tracks import moving
from zenocap.common import messages as m
from zenocap.common.formats.take_poses import read_poses
from zenocap.tools.takes.render.caption import CaptionSpan, label_at, read_labels
from zenocap.tools.takes.render.film import Drawing, RenderOptions

SECOND = 1_000_000_000


def posture(label: str | None, start_s: float, end_s: float) -> m.Posture:
    start_ns, end_ns = START_NS + round(start_s * SECOND), START_NS + round(end_s * SECOND)
    return built(m.Posture, captured_ns=end_ns, label=label, start_ns=start_ns, end_ns=end_ns)


def take_with(folder: Path, *postures: m.Posture) -> Path:
    return write_take(folder / "take.mcap", [*messages_of_track(moving(30, rate=30.0)), *postures])


def test_postures_are_sorted_by_start_without_unknown_ones(tmp_path: Path) -> None:
    take = take_with(tmp_path, posture("squat", 0.5, 0.8), posture(None, 0.2, 0.3), posture("winken 走", 0.1, 0.4))
    assert [(span.label, span.start_ns - START_NS) for span in read_labels(take)] == [
        ("winken 走", SECOND // 10), ("squat", SECOND // 2),
    ]  # fmt: skip


def test_of_several_postures_the_one_that_started_last_is_used() -> None:
    spans = (CaptionSpan("walk", 0, 100), CaptionSpan("kick", 40, 60))
    assert [label_at(spans, at) for at in (0, 40, 60, 61, 100, 101)] == ["walk", "kick", "kick", "walk", "walk", ""]


def test_a_caption_has_the_posture_of_its_time(tmp_path: Path) -> None:
    poses = read_poses(take_with(tmp_path, posture("squat", 0.4, 0.7)))
    track = poses.track()
    drawing = Drawing(poses, track, RenderOptions(size=(64, 64)), track, 1)
    assert [drawing.caption(row).label for row in (0, 12, 21, 22)] == ["", "squat", "squat", ""]
    assert drawing.caption_of_picture(15, 15).label == "squat"
    assert drawing.caption_of_picture(12, 20).label == ""
