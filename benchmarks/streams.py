"""Network cameras on this machine: connection, age of the images, jitter, lost frames, and the return after a cut.

    python -m benchmarks.streams [--seconds S] [--cut S] [--fps F] [--size WxH]

A server sends JPEG images over RTSP, and one over HTTP, each with a time code drawn into the image.  Age: from drawing to
the decoded image in a viewer's source.  Jitter: of the capture times that the frames get, 95th percentile of the deviation
from the median interval; of RTSP after the 10 s in which the stream's clock is checked.
"""

import argparse
import threading
import time
from itertools import pairwise

import numpy as np

from tests.support.mjpeg_server import BITS, MjpegServer, time_in
from tests.support.rtsp_server import RtspServer
from zenocap.common.rig.sources import Stream
from zenocap.common.runtime.clock import RealClock
from zenocap.services.viewer.sources.device import camera_frames
from zenocap.services.viewer.sources.playback import Playback


def measured(server: RtspServer | MjpegServer, seconds: float, cut_s: float) -> str:
    """One line of figures.  cut_s: how long an RTSP server refuses connections; 0 for not at all."""
    size, reports = server.size, list[tuple[float, str]]()
    playback = Playback(
        time.time_ns(), RealClock(), report=lambda text: reports.append((time.monotonic(), text)), sleep=time.sleep
    )
    begin_s = time.monotonic()
    frames = camera_frames(Stream(server.url), 1000.0, size, size, playback)
    first = next(frames)
    connect_s, sent_before = time.monotonic() - begin_s, server.sent
    ages, times = [], [first.captured_ns]
    while time.monotonic() - begin_s < connect_s + seconds:
        frame = next(frames)
        ages.append((time.monotonic_ns() // 1_000_000 - time_in(np.asarray(frame.image))) % (1 << BITS))
        times.append(frame.captured_ns)
    lost = server.sent - sent_before - len(ages)
    settled = times[len(times) * 3 // 4 :]
    intervals = np.array([b - a for a, b in pairwise(settled)]) / 1e6
    jitter_ms = np.percentile(np.abs(intervals - np.median(intervals)), 95)
    text = (
        f"first image {connect_s:.2f} s, age median {np.median(ages):.0f} ms, "
        f"99th percentile {np.percentile(ages, 99):.0f} ms, "
        f"jitter {jitter_ms:.2f} ms, {max(0, lost)} of {len(ages) + max(0, lost)} frames lost"
    )
    if cut_s and isinstance(server, RtspServer):
        server.cut()
        timer = threading.Timer(cut_s, server.resume)
        timer.start()
        cut_at_s = time.monotonic()
        while not any("back after" in report for _, report in reports):
            next(frames)
        next(frames)
        text += f"; back {time.monotonic() - cut_at_s - cut_s:.1f} s after the end of a cut of {cut_s:g} s"
        timer.join()
    frames.close()  # type: ignore[attr-defined]  # a generator
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--cut", type=float, default=10.0)
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--size", default="640x480", help="sides: multiples of 16 px")
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    for name, kind in (("RTSP", RtspServer), ("HTTP", MjpegServer)):
        with kind((width, height), options.fps) as server:
            print(
                f"{name} {options.size} at {options.fps:g}/s: {measured(server, options.seconds, options.cut)}", flush=True
            )


if __name__ == "__main__":
    main()
