"""Frames of several videos by their times, and lines about unusual ones."""

from collections.abc import Iterator

import numpy as np
import pytest

from zenocap.common.errors import EndedEarly
from zenocap.common.video.frame_times import timing_of
from zenocap.common.video.reader import VideoSummary
from zenocap.services.viewer.frame import Frame
from zenocap.tools.takes.inputs import Inputs

PERIOD = 1 / 30
IMAGE = np.zeros((2, 2, 3), np.uint8)


def frames(times_s: list[float], *, initial: bool = False) -> Iterator[Frame]:
    return (Frame(k, round(time * 1e9), IMAGE, initial=initial) for k, time in enumerate(times_s))


def grouped(inputs: Inputs, sources: dict[str, Iterator[Frame]]) -> list[dict[str, int]]:
    """Frame numbers of the frame sets."""
    return [{id: frame.frame for id, frame in group.items()} for group in inputs.frame_sets(sources, round(0.5e9 * PERIOD))]


def even(count: int, start: float = 0.0) -> list[float]:
    return [start + k * PERIOD for k in range(count)]


def test_frames_within_half_a_period_form_one_frame_set() -> None:
    other = [0.1 * PERIOD, 1.9 * PERIOD, 3.3 * PERIOD]
    groups = grouped(Inputs(), {"a": frames(even(4)), "b": frames(other)})
    assert groups == [{"a": 0, "b": 0}, {"a": 1}, {"a": 2, "b": 1}, {"a": 3, "b": 2}]


def test_videos_of_different_lengths_are_used_where_both_have_frames() -> None:
    inputs = Inputs()
    groups = grouped(inputs, {"a": frames(even(100)), "b": frames(even(40, 20 * PERIOD))})
    assert groups == [
        *({"a": k} for k in range(20)),
        *({"a": k, "b": k - 20} for k in range(20, 60)),
        *({"a": k} for k in range(60, 100)),
    ]
    assert inputs.notes() == ["b: begins 0.67 s after the first camera", "b: ends 1.33 s before the last camera"]
    assert inputs.left_out() == ["a: 60 of 100 frames left out: no other camera has one at their time"]


def test_a_gap_of_one_video_moves_no_later_frame() -> None:
    inputs, times = Inputs(), [time for k, time in enumerate(even(60)) if not 20 <= k < 32]
    groups = grouped(inputs, {"a": frames(even(60)), "b": frames(times)})
    assert groups[40] == {"a": 40, "b": 28}
    inputs.videos["b"] = VideoSummary(timing_of([round(time * 1e9) for time in times]), 0, 0)
    assert inputs.notes() == ["b: no frames from 0.63 to 1.07 s, 12 missing"]
    assert inputs.left_out() == ["a: 12 of 60 frames left out: no other camera has one at their time"]


def test_third_camera_keeps_frames_of_the_others_in_use() -> None:
    inputs = Inputs()
    grouped(inputs, {"a": frames(even(60)), "b": frames(even(60)), "c": frames(even(20))})
    assert inputs.left_out() == []


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5, 0.7])
def test_varying_periods_lose_no_frames(phase: float) -> None:
    rng, inputs = np.random.default_rng(2), Inputs()
    times = [sorted((np.arange(90) + shift + rng.uniform(-0.08, 0.08, 90)) * PERIOD) for shift in (1.0, 1.0 + phase)]
    groups = grouped(inputs, {"a": frames(times[0]), "b": frames(times[1])})
    assert sum(len(group) == 1 for group in groups) <= 2
    assert inputs.left_out() == []


def test_slightly_different_rates_are_followed() -> None:
    inputs = Inputs()
    groups = grouped(inputs, {"a": frames(even(3000)), "b": frames([k / 29.97 for k in range(2998)])})
    late = [abs(group["a"] / 30 - group["b"] / 29.97) for group in groups if len(group) == 2]
    assert len(late) >= 2990
    assert max(late) < 0.76 * PERIOD
    assert inputs.left_out() == []


def test_failing_source_is_a_problem_and_the_others_go_on() -> None:
    def broken() -> Iterator[Frame]:
        yield from frames(even(2))
        raise EndedEarly("b.mp4: cut")

    inputs = Inputs()
    assert len(grouped(inputs, {"a": frames(even(5)), "b": broken()})) == 5
    assert inputs.problems == ["b.mp4: cut"]


def test_variable_rates_damage_and_missing_times_are_said() -> None:
    times = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.06, 100))
    inputs = Inputs(videos={"a": VideoSummary(timing_of([round(time * 1e9) for time in times]), 3, 2)})
    variable, estimated = inputs.notes()
    assert variable.startswith("a: variable frame rate, 2")
    assert estimated == "a: 2 frames have no time in the file: one period after the frame before"
    assert inputs.left_out() == ["a: 3 damaged frames left out"]


def test_many_gaps_are_summed_up() -> None:
    times = [round(time * 1e9) for k, time in enumerate(even(200)) if k % 20 not in (5, 6, 7)]
    notes = Inputs(videos={"a": VideoSummary(timing_of(times), 0, 0)}).notes()
    assert notes[:3] == [
        f"a: no frames from {a:.2f} to {a + 4 * PERIOD:.2f} s, 3 missing" for a in (4 / 30, 24 / 30, 44 / 30)
    ]
    assert notes[3] == "a: 7 more gaps, 21 frames missing"


def test_the_rate_is_that_of_the_camera_where_the_container_rounds_times() -> None:
    """Matroska has milliseconds: the median interval of 30 frames/s is 33 ms."""
    assert timing_of([round(1000 * k / 30) * 1_000_000 for k in range(90)]).rate == pytest.approx(30.0, rel=1e-3)
