"""Video files of any container, codec, pixel format and frame times."""

from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path

import av
from av.video.stream import VideoStream

from zenocap.common.arrays import Image

CLOCK = 90_000  # ticks a second of given frame times
OPTIONS = {
    "libx264": {"crf": "10", "preset": "ultrafast"},
    "libx265": {"crf": "10", "preset": "ultrafast", "x265-params": "log-level=none"},
    "libvpx-vp9": {"crf": "15", "b": "0", "deadline": "realtime", "cpu-used": "8"},
}


def write_video(
    path: Path,
    images: Iterable[Image],
    times_s: Sequence[float] | None = None,
    *,
    fps: int = 30,
    codec: str = "libx264",
    pixels: str = "yuv420p",
) -> Path:
    """Write images (height, width, 3), blue, green, red, of one size; at increasing times, else at a constant rate."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream: VideoStream | None = None
        for k, image in enumerate(images):
            if stream is None:
                added = container.add_stream(codec, rate=fps, options=OPTIONS.get(codec, {}))
                assert isinstance(added, VideoStream)
                stream = added
                stream.width, stream.height, stream.pix_fmt = image.shape[1], image.shape[0], pixels
                if times_s is not None:
                    stream.codec_context.time_base = Fraction(1, CLOCK)
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = k, Fraction(1, fps)
            if times_s is not None:
                frame.pts, frame.time_base = round(times_s[k] * CLOCK), Fraction(1, CLOCK)
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode(None))
    return path
