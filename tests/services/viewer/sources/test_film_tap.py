"""Films of a running source: every image, unreduced, also where the viewer leaves frames out."""

from dataclasses import replace
from itertools import islice

import numpy as np

from tests.services.viewer.sources.test_sources import SIZE, WORKING, FakeCamera, FakeTime, S, live, opening
from zenocap.common.messages import FilmQuery
from zenocap.common.rig.sources import Device
from zenocap.common.runtime.frame_rate import FrameChoice
from zenocap.services.viewer.sources.device import camera_frames
from zenocap.services.viewer.sources.resize import Fit
from zenocap.services.viewer.sources.tap import Tap

QUERY = FilmQuery(frame=0, captured_ns=0, what="open", sender="me", film="a", camera="b")


class EverySecond(FrameChoice):
    """Of an overloaded rig."""

    def __init__(self) -> None:
        super().__init__(10.0)
        self.asked = 0

    def wants(self, captured_ns: int) -> bool:
        self.asked += 1
        return self.asked % 2 == 0


def test_every_image_is_filmed_at_the_calibrated_size() -> None:
    time, tap, images = FakeTime(ns=S), Tap(SIZE, 10.0), []
    playback = replace(live(time), choice=EverySecond())
    stream = camera_frames(Device(0), 10.0, SIZE, playback, opening([FakeCamera(time, 100)]), Fit(SIZE, WORKING), film=tap)
    first = list(islice(stream, 3))
    assert not images
    tap.open(QUERY, lambda image, captured_ns: images.append((image, captured_ns)))
    second = list(islice(stream, 5))
    tap.close()
    count = len(images)
    list(islice(stream, 3))
    assert len(images) == count
    assert count in (9, 10)
    assert {image.shape for image, _ in images} == {(SIZE[1], SIZE[0], 3)}
    assert {frame.image.shape for frame in (*first, *second)} == {(WORKING[1], WORKING[0], 3)}
    gaps = np.diff([captured_ns for _, captured_ns in images])
    assert gaps.max() < 1.5 * S / 10
    numbers = [frame.frame for frame in (*first, *second)]
    assert set(np.diff(numbers)) == {2}


def test_a_tap_counts_failures_of_a_film_only() -> None:
    tap = Tap(SIZE, 10.0)
    tap.lost()
    assert tap.away == 0
    tap.open(QUERY, lambda image, captured_ns: None)
    tap.lost()
    assert tap.away == 1
