"""Video files of any codec, pixel format and frame times, written for tests."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from zenocap.common.arrays import Image

GREY_STEP = 10  # of grey values from one frame to the next


def grey_frames(count: int, size: tuple[int, int] = (64, 48)) -> list[Image]:
    """Frame k has the grey value GREY_STEP * (k % 24)."""
    return [np.full((size[1], size[0], 3), GREY_STEP * (k % 24), np.uint8) for k in range(count)]


def write_frames(
    path: Path,
    images: Sequence[Image],
    times_s: Sequence[float] | None = None,
    *,
    fps: int = 30,
    codec: str = "libx264",
    pixels: str = "yuv420p",
) -> Path:
    """A video of the images, at these times or at a constant rate."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=fps)
        stream.width, stream.height, stream.pix_fmt = images[0].shape[1], images[0].shape[0], pixels
        if codec in ("libx264", "libx265"):
            stream.options = {"crf": "10", "preset": "ultrafast"} | (
                {"x265-params": "log-level=none"} if "5" in codec else {}
            )
        if times_s is not None:
            stream.codec_context.time_base = Fraction(1, 90_000)
        for k, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            if times_s is None:
                frame.pts, frame.time_base = k, Fraction(1, fps)
            else:
                frame.pts, frame.time_base = round(times_s[k] * 90_000), Fraction(1, 90_000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path
