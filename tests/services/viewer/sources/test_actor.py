"""Frames of the simulated person: shared epoch, late start, live and offline playback."""

from itertools import islice

import numpy as np
import pytest

from tests.services.viewer.sources.test_sources import FakeTime, S, live
from zenocap.common.errors import OpenError
from zenocap.common.rig.rig import demo_rig
from zenocap.common.rig.sources import Actor
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.actor import actor_frames, performance
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.source import open_source

EPOCH = 1_000 * S
VIEWER = demo_rig("two-view").viewers[0]


def person_pixels(frame: Frame, empty: Frame) -> int:
    return int((np.abs(frame.image.astype(int) - empty.image.astype(int)).max(axis=2) > 30).sum())


@pytest.mark.slow
def test_times_are_whole_periods_of_the_shared_epoch_for_any_start():
    for start_ns, first in ((EPOCH - 2 * S, 0), (EPOCH + 10 * S + 12_345, 150)):
        frames = islice(open_source(VIEWER, live(FakeTime(start_ns), EPOCH)), 4)
        expected = [(k, EPOCH + round(k * S / 15)) for k in range(first, first + 4)]
        assert [(f.frame, f.captured_ns) for f in frames] == expected


@pytest.mark.slow
def test_viewers_that_started_at_different_times_see_the_same_frame():
    def seen(start_ns: int, count: int) -> dict[int, np.ndarray]:
        frames = actor_frames(Actor("demo", 0), 15.0, VIEWER.camera, live(FakeTime(start_ns), EPOCH), 2)
        return {f.frame: f.image for f in islice(frames, count)}

    a, b = seen(EPOCH + 6 * S, 12), seen(EPOCH + 6 * S + S // 3, 7)
    shared = sorted(set(a) & set(b))[2:]
    assert shared
    for index in shared:
        np.testing.assert_array_equal(a[index], b[index])


def test_a_viewer_that_joins_late_sees_the_empty_scene_first():
    frames = list(islice(open_source(VIEWER, live(FakeTime(EPOCH + 5 * S), EPOCH)), 32))
    assert person_pixels(frames[29], frames[0]) < 5
    assert person_pixels(frames[30], frames[0]) > 100


@pytest.mark.slow
def test_late_frames_are_skipped_in_live_playback():
    time, indices = FakeTime(EPOCH), []
    for frame in islice(open_source(VIEWER, live(time, EPOCH)), 5):
        indices.append(frame.frame)
        if frame.frame == 1:
            time.ns += S
    assert indices == [0, 1, 16, 17, 18]


@pytest.mark.slow
def test_the_script_is_played_once_offline():
    source = Actor("squat", 3)
    frames = list(actor_frames(source, 5.0, VIEWER.camera, Playback(EPOCH, FakeTime(), live=False), 0))
    assert [f.frame for f in frames] == list(range(int(performance(source).duration_s * 5)))
    assert person_pixels(frames[-1], frames[0]) > 100


def test_an_unknown_performance_lists_what_is_allowed():
    with pytest.raises(OpenError, match="actor:dancing: allowed: demo, walking, turning, running, boxing or a posture"):
        performance(Actor("dancing", 0))
