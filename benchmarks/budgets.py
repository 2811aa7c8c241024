"""Budgets of speed: offline frames/s by number of views; time of the tracker per frame set, alone and beside load.

    python -m benchmarks.budgets [--clips DIR] [--views 7 4 2] [--jobs 1 2] [--busy 0 2 | --busy] [--rounds 3] [--frames N]

Offline: `zenocap track` of videos of 640x480, both passes, from the first frame set to the complete take, and the first
pass alone; every number of jobs must write the same take.  Real time: silhouettes in memory to pose, 30 frame sets a
second, beside `busy` processes that never wait; none for no such measurement.
Each round is a process of its own; figures are medians over the rounds.  Without the shared clips nothing is measured.
"""

import argparse
import hashlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np
from benchmarks.clips import SHARED
from benchmarks.hybrid.accuracy import VIEWS
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import ANATOMY, Case, setup_of
from benchmarks.hybrid.silhouettes import load_clip

from benchmarks.table import table
from zenocap.common.rig.rig import load_rig
from zenocap.services.tracker import tracking
from zenocap.services.tracker.jit_warmup import load_compiled
from zenocap.services.tracker.prior.file import find_prior, read_prior
from zenocap.tools.recordings.both_ways import add_both_ways
from zenocap.tools.recordings.track import TrackedFrameSet, track

Result = TypeVar("Result")

CLIPS = {7: "walk7", 4: "walk7", 3: "walk7", 2: "walk2"}
PERIOD_S = 1 / 30  # of frame sets in real time
AIM_FPS = {7: 25.0, 4: 40.0}
AIM_MS = {7: "12, 16", 2: "8"}  # wall, processor
AIM_P99_MS = 60.0  # beside two busy processes


@dataclass(frozen=True)
class Spent:
    """Medians in milliseconds per frame set."""

    wall_ms: float
    processor_ms: float
    p99_ms: float


@dataclass(frozen=True)
class OfflineSpent:
    """Frame sets per second and processor time per frame set, of both passes and of the first one.  digest: of the take."""

    rate: float
    first_rate: float
    processor_ms: float
    first_processor_ms: float
    digest: str


def offline(clips: Path, views: int, jobs: int, frames: int | None) -> OfflineSpent:
    """Track the first `frames` frame sets of the videos both ways, all for None."""
    rig = load_rig(clips / CLIPS[views])
    chosen = VIEWS[str(views)] if CLIPS[views] == "walk7" else ()
    rig = replace(rig, viewers=tuple(viewer for viewer in rig.viewers if not chosen or viewer.id in chosen))
    times: list[tuple[float, float]] = []

    def note(_: TrackedFrameSet) -> None:
        times.append((time.perf_counter(), time.process_time()))
        if len(times) == frames:
            raise StopIteration

    with TemporaryDirectory() as folder:
        take = Path(folder) / "take.mcap"
        with suppress(StopIteration):
            track(rig, take, note, jobs)
        first = (np.array(times[-1]) - times[0]) / (len(times) - 1)
        ended = time.perf_counter(), time.process_time()
        add_both_ways(rig, take, jobs=jobs)
        both = first + (np.array((time.perf_counter(), time.process_time())) - ended) / len(times)
        digest = hashlib.sha256(take.read_bytes()).hexdigest()
    return OfflineSpent(1 / both[0], 1 / first[0], 1e3 * both[1], 1e3 * first[1], digest)


def real_time(clips: Path, views: int, cache: Path, frames: int | None) -> Spent:
    """Track silhouettes at a fixed rate; frame sets of the motion count."""
    name = CLIPS[views]
    clip = load_clip(clips / name, cache)
    chosen = VIEWS[str(views)] if name == "walk7" else ()
    setup = setup_of(clip, Case(name, views=chosen), read_prior(find_prior(KINDS[name]), ANATOMY))
    load_compiled(setup)
    state, spent = tracking.initial_state(setup), []
    due_s = time.perf_counter()
    for instant in clip.instants[:frames]:
        masks = clip.masks(instant, setup.cameras)
        if instant.frame >= clip.motion_from:
            due_s = max(due_s + PERIOD_S, time.perf_counter())
            time.sleep(max(0.0, due_s - time.perf_counter()))
        started = time.perf_counter(), time.process_time()
        state, outcome = tracking.track(setup, state, instant.captured_ns, masks)
        if outcome.pose is not None or frames is not None:
            spent.append((time.perf_counter() - started[0], time.process_time() - started[1]))
    seconds = np.array(spent)
    wall, processor = 1e3 * np.median(seconds, axis=0)
    return Spent(float(wall), float(processor), float(np.percentile(1e3 * seconds[:, 0], 99)))


@contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """Run processes that never wait."""
    processes = [get_context("spawn").Process(target=_spin, daemon=True) for _ in range(count)]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
            process.join()


def _spin() -> None:
    while True:
        pass


def in_process(function: Callable[..., Result], *arguments: object) -> Result:
    """Result of a module's function in a process of its own."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(function, arguments)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, default=SHARED / "clips")
    parser.add_argument("--out", type=Path, default=Path("build") / "budgets", help="folder of the silhouettes")
    parser.add_argument("--views", type=int, nargs="+", default=[7, 4, 2], choices=sorted(CLIPS))
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--busy", type=int, nargs="*", default=[0, 2])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, help="frame sets of a clip; default: all")
    options = parser.parse_args()
    if not options.clips.is_dir():
        print(f"budgets: skipped: {options.clips} missing (the shared test clips are expected beside the checkout)")
        return
    rows, live = [], []
    for views in options.views:
        found = {jobs: [] for jobs in options.jobs}  # type: dict[int, list[OfflineSpent]]
        for _ in range(options.rounds):  # interleaved: the machine's speed changes
            for jobs, runs in found.items():
                runs.append(in_process(offline, options.clips, views, jobs, options.frames))
        digests = {run.digest for runs in found.values() for run in runs}
        if len(digests) > 1:
            raise SystemExit(f"{views} views: takes of equal input differ: {sorted(digests)}")
        for jobs, runs in found.items():
            names = ("rate", "first_rate", "processor_ms", "first_processor_ms")
            rows.append((f"{views} views", jobs, *(_median(runs, name) for name in names), AIM_FPS.get(views, "")))
    for views in options.views:
        for busy in options.busy:
            with busy_processes(busy):
                timed = [
                    in_process(real_time, options.clips, views, options.out, options.frames) for _ in range(options.rounds)
                ]
            aim = AIM_MS.get(views, "") if busy == 0 else f"p99 {AIM_P99_MS:.0f}"
            times = (_median(timed, name) for name in ("wall_ms", "p99_ms", "processor_ms"))
            live.append((f"{views} views", busy, *times, aim))
    columns = ("views", "jobs", "frames/s", "first pass", "processor ms", "first pass ms", "aim frames/s")
    print(table("Offline: videos of 640x480 to a take", columns, rows))
    if not live:
        return
    real_time_columns = ("views", "busy", "wall ms", "p99 ms", "processor ms", "aim ms")
    print(table("Real time: silhouettes to pose, 30 frame sets/s", real_time_columns, live))


def _median(runs: Sequence[object], name: str) -> float:
    return float(np.median([getattr(run, name) for run in runs]))


if __name__ == "__main__":
    main()
