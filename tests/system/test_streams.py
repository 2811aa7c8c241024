"""Network cameras: first image, age, a cut connection, true rates, reasons."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from tests.support.mjpeg_server import BITS, MjpegServer, time_in, with_time
from tests.support.rtsp_server import RtspServer
from zenocap.common.rig.sources import Stream
from zenocap.common.runtime.clock import RealClock
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.device import camera_frames
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.stamps import SourceRate
from zenocap.tools.setup.cameras.streams import tried_stream

pytestmark = pytest.mark.nightly  # ages and rates of images in real time, which load changes
SIZE, FPS = (320, 240), 25.0
CUT_S = 3.0


@pytest.fixture(params=[RtspServer, MjpegServer])
def server(request: pytest.FixtureRequest) -> Iterator[RtspServer | MjpegServer]:
    with request.param(SIZE, FPS) as running:
        yield running


def age_ms(image: np.ndarray) -> int:
    return (time.monotonic_ns() // 1_000_000 - time_in(image)) % (1 << BITS)


def frames_of(url: str, reports: list[str], rate: SourceRate | None = None) -> Iterator[Frame]:
    playback = Playback(time.time_ns(), RealClock(), report=reports.append)
    return camera_frames(Stream(url), 1000.0, SIZE, playback, rate=rate)


def test_a_stream_is_tried(server):
    found = tried_stream(server.url, 1.0)
    assert (found.problem, found.size, found.codec) == ("", SIZE, "mjpeg")
    assert found.rate == pytest.approx(FPS, rel=0.4)  # counted for one second, beside load
    assert age_ms(found.image) < 5000


def test_images_of_a_slow_reader_are_not_older_than_the_last_ones(server):
    """The service's reader thread takes all frames; here, too, none may wait in FFmpeg's queue."""
    rate = SourceRate()
    frames = frames_of(server.url, [], rate)
    ages = [age_ms(next(frames).image) for _ in range(60)]
    assert max(ages[:5]) < 500  # of the first ones, too
    assert np.median(ages) < 100
    assert rate.counts()["source_frames_per_1000_s"] == pytest.approx(1000 * FPS, rel=0.15)
    frames.close()


def test_times_of_rtsp_are_those_of_the_stream():
    with RtspServer(SIZE, FPS) as server:
        frames = frames_of(server.url, [])
        times = [next(frames).captured_ns for _ in range(int(14 * FPS))]
        frames.close()
    late = np.diff(times[int(11 * FPS) :]) / 1e6
    assert np.abs(late - 1000 / FPS).max() < 8  # received ones vary with the load of the machine
    assert time.time_ns() - times[-1] < 2e9


def test_a_stream_comes_back_after_a_cut():
    reports: list[str] = []
    with RtspServer(SIZE, FPS) as server:
        frames = frames_of(server.url, reports)
        assert [next(frames).frame for _ in range(10)] == list(range(10))
        server.cut()
        back = threading.Timer(CUT_S, server.resume)
        back.start()
        begin_s = time.monotonic()
        index = 9
        while not any("back after" in text for text in reports):
            index += 1
            assert next(frames).frame == index
        assert CUT_S - 0.5 < time.monotonic() - begin_s < CUT_S + 15
        assert age_ms(next(frames).image) < 1000
        frames.close()
        back.join()
    assert "trying again" in reports[0]


def test_the_time_code_is_read_as_it_was_drawn():
    assert [time_in(with_time(SIZE, value)) for value in (0, 1, 123_456, (1 << BITS) - 1)] == [
        0,
        1,
        123_456,
        (1 << BITS) - 1,
    ]
