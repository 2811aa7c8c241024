"""Time to decode a frame of a video, by container and codec, beside OpenCV's reader; and memory over a long video.

    python -m benchmarks.decoding [--sizes 640x480 1920x1080] [--frames 120] [--minutes 60]

The videos show a moving textured shape and are written for the measurement.  Both readers give images of blue, green and
red; processor time is that of all threads.  The long video has 30 frames/s in 64x48.
"""

import argparse
import resource
import time
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.table import table
from zenocap.common.arrays import Image
from zenocap.common.video.reader import VideoReader
from zenocap.simulation.rendering.video_file import write_video

FORMATS = (
    ("mp4", "libx264", "yuv420p"),
    ("mov", "libx264", "yuv422p10le"),
    ("mp4", "libx265", "yuv420p"),
    ("mp4", "libx265", "yuv420p10le"),
    ("webm", "libvpx-vp9", "yuv420p"),
    ("mov", "prores_ks", "yuv422p10le"),
    ("avi", "mjpeg", "yuvj420p"),
    ("mkv", "ffv1", "gray"),
    ("avi", "rawvideo", "bgr24"),
)
LONG_FPS, LONG_SIZE = 30, (64, 48)
WARM_FRAMES = 1000  # before the memory of the long video is measured


def pictures(size: tuple[int, int], frames: int) -> Iterator[Image]:
    """A moving texture behind a moving disc, (height, width, 3)."""
    noise = np.random.default_rng(1).integers(0, 255, (size[1] // 8, size[0] // 8, 3), np.uint8)
    texture: Image = np.asarray(cv2.resize(noise, size, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)
    for k in range(frames):
        image = np.ascontiguousarray(np.roll(texture, 3 * k, axis=1))
        cv2.circle(image, ((7 * k) % size[0], size[1] // 2), size[1] // 4, (40, 90, 200), -1)
        yield image


def read_own(path: Path) -> int:
    with VideoReader(path) as reader:
        while (frame := reader.next()) is not None:
            frame.image()
        return reader.read


def read_opencv(path: Path) -> int:
    capture, count = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG), 0
    while capture.read()[0]:
        count += 1
    capture.release()
    return count


def timed(read: Callable[[Path], int], path: Path) -> tuple[int, float, float]:
    """Frames, and milliseconds of wall and processor time a frame; the faster of two passes."""
    best = (0, np.inf, np.inf)
    for _ in range(2):
        wall, processor = time.perf_counter(), time.process_time()
        count = read(path)
        used = (time.perf_counter() - wall) * 1e3 / max(count, 1), (time.process_time() - processor) * 1e3 / max(count, 1)
        best = (count, min(best[1], used[0]), min(best[2], used[1]))
    return best


def memory(path: Path) -> list[tuple[int, float]]:
    """Frames read, and largest memory of the process so far, MB: after WARM_FRAMES, and each tenth of the video."""
    found = []
    with VideoReader(path) as reader:
        tenth = max(1, reader.declared // 10)
        while (frame := reader.next()) is not None:
            frame.image()
            if reader.read == WARM_FRAMES or reader.read % tenth == 0:
                found.append((reader.read, _peak_mb()))
        return [*found, (reader.read, _peak_mb())]


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", default=["640x480", "1920x1080"], metavar="WxH")
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--minutes", type=float, default=60.0, help="of the long video; 0 for none")
    options = parser.parse_args()
    rows = []
    with TemporaryDirectory() as folder:
        for text in options.sizes:
            width, height = (int(side) for side in text.split("x"))
            for suffix, codec, pixels in FORMATS:
                path = Path(folder) / f"a.{suffix}"
                write_video(path, pictures((width, height), options.frames), codec=codec, pixels=pixels)
                own, other = timed(read_own, path), timed(read_opencv, path)
                rows.append([text, suffix, codec.removeprefix("lib"), pixels, *own, *other])
                path.unlink()
        head = [
            "size",
            "file",
            "codec",
            "pixels",
            "frames",
            "ms wall",
            "ms processor",
            "OpenCV: frames",
            "ms wall",
            "ms processor",
        ]
        print(table("Decoding, a frame", head, rows))
        if options.minutes:
            path = Path(folder) / "long.mp4"
            frames = round(options.minutes * 60 * LONG_FPS)
            write_video(path, pictures(LONG_SIZE, frames), fps=LONG_FPS, codec="mpeg4")
            with get_context("spawn").Pool(1) as pool:  # a process of its own, as the peak is that of a whole process
                peaks = pool.apply(memory, (path,))
            print(table(f"Memory over {options.minutes:g} minutes", ["frames", "peak MB"], peaks))


if __name__ == "__main__":
    main()
