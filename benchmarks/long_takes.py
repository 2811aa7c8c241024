"""Memory of `zenocap track` over a long recording, in both passes.

    python -m benchmarks.long_takes [--minutes 10] [--fps 15] [--jobs 1]

Two videos of 160x120 of the simulated person, one minute of the demo played forwards and backwards in turn, so that nothing
jumps.  resident: memory of the process, MB, at the number of frame sets or poses.
"""

import argparse
import time
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.table import table
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Image
from zenocap.common.camera.calibration_files import write_calibration
from zenocap.common.rig.rig import load_rig
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.simulation.rendering.video_file import write_video
from zenocap.tools.recordings.both_ways import track_both_ways
from zenocap.tools.recordings.track import TrackedFrameSet

SIZE, EMPTY, LOOP_S, PERSON = (160, 120), 15, 60.0, 4
SAMPLES = 8  # of the memory, in each pass
Row = tuple[str, int, float]


def frames(viewer: int, fps: float, count: int) -> Iterator[Image]:
    """The empty scene, then the loop, forwards and backwards in turn."""
    subject = person(PERSON)
    script = demo_timeline(subject, 0)
    first_s = script.segments[0].end_s
    renderer = SimulatedCamera(paper_cameras(SIZE)[viewer], subject, 0)
    for k in range(EMPTY):
        yield renderer.render(None, k)
    length = min(int((script.duration_s - first_s) * fps), int(LOOP_S * fps))
    loop = np.stack([renderer.render(script.pose_at(first_s + k / fps), k) for k in range(length)])
    for k in range(count - EMPTY):
        turn, at = divmod(k, length)
        yield loop[at if turn % 2 == 0 else length - 1 - at]


def resident_mb() -> float:
    """Memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def measure(folder: Path, jobs: int) -> tuple[list[Row], int, float]:
    """Rows of pass, number done and memory; number of poses; processor time in seconds."""
    cv2.setNumThreads(1)
    rig = load_rig(folder)
    rows: list[Row] = [("start", 0, resident_mb())]
    expected = int((folder / "count").read_text())
    done = 0

    def on_frame_set(_: TrackedFrameSet) -> None:
        nonlocal done
        done += 1
        if done % (expected // SAMPLES) == 0:
            rows.append(("forward", done, resident_mb()))

    def watch(activity: str, number: int, total: int) -> None:
        if number and (number % (total // SAMPLES) == 0 or number == total):
            rows.append((activity, number, resident_mb()))

    result = track_both_ways(rig, folder / "take.mcap", on_frame_set, watch, jobs)
    return rows, result.poses, time.process_time()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--fps", type=float, default=15.0)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    count = round(options.minutes * 60 * options.fps)
    with TemporaryDirectory() as name:
        folder = Path(name) / "long"
        (folder / "videos").mkdir(parents=True)
        cameras = dict(zip(("cam01", "cam02"), paper_cameras(SIZE), strict=True))
        for k, camera in enumerate(cameras):
            path = folder / "videos" / f"{camera}.mp4"
            write_video(path, frames(k, options.fps, count), fps=round(options.fps), codec="mpeg4")
        write_calibration(folder / "calibration.toml", cameras)
        (folder / "clip.toml").write_text(f"empty_frames = {EMPTY - 1}\n")
        (folder / "count").write_text(str(count))
        with get_context("spawn").Pool(1) as pool:
            rows, poses, used_s = pool.apply(measure, (folder, options.jobs))
        size_mb = (folder / "take.mcap").stat().st_size / 1e6
    title = f"{count} frames at {options.fps:g}/s, {poses} poses, take {size_mb:.0f} MB, {used_s:.0f} s of processor time"
    print(table(title, ["pass", "done", "resident MB"], [list(row) for row in rows]))


if __name__ == "__main__":
    main()
