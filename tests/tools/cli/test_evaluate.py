"""Notes of `zenocap evaluate`."""

import numpy as np

from zenocap.common.formats.trajectories import Trajectories
from zenocap.tools.cli.evaluate import pairing_note


def file(count: int, rate: float, step: int = 1, first: int = 0) -> Trajectories:
    """Every step-th of `count` frames that were filmed at `rate` frames/s."""
    frames = np.arange(first, count, step)
    return Trajectories(("Hip",), frames, frames / rate, np.zeros((len(frames), 1, 3)), rate / step)


def test_frames_of_equal_numbers_at_equal_times_need_no_note() -> None:
    assert pairing_note(file(100, 30.0), file(100, 29.97), 1, 0) == ""
    assert pairing_note(file(100, 60.0, step=2), file(100, 60.0), 2, 0) == ""
    assert pairing_note(file(120, 30.0, first=20), file(100, 30.0), 1, 20) == ""


def test_a_video_of_half_the_rate_has_other_times() -> None:
    for every in (1, 2):
        assert "last 3.27 s in the take and 1.63 s in the truth" in pairing_note(file(99, 30.0), file(200, 60.0), every, 0)


def test_a_take_of_every_second_frame_needs_the_option() -> None:
    assert "give --every 2" in pairing_note(file(100, 60.0, step=2), file(100, 60.0), 1, 0)
