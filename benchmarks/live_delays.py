"""Delays of cameras as the integrator of a running rig finds and corrects them: errors, and the time until corrected.

    python -m benchmarks.live_delays [--frames 0.3,1,2,5] [--views 2] [--seeds 5] [--first-seed 20] [--fps 30]

Simulated people walk to and fro on a figure of eight, seen in 320 x 240 with ragged edges by calibrated cameras; the second
camera's images are older than their times by so many frame periods.  The step of the integrator gets the silhouettes and a
tick each second, as live, with `delays = "follow"`.  found: error of the last estimate; others: largest delay of another
camera.  corrected: error of what the tracker subtracts in the end, and the time from the first silhouette until then.
step: longest step, ms of processor time; share: processor time of all steps per second of the rig, in the mean.
"""

import argparse
from collections.abc import Iterator, Sequence
from itertools import product
from time import process_time_ns

import numpy as np

from tests.support.walkers import Walker, walker
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.messages import CameraDelays, Silhouette
from zenocap.common.topics import SILHOUETTE
from zenocap.common.vision.mask_codec import pack
from zenocap.services.integrator import timekeeper
from zenocap.services.integrator.camera_delays import DelaySetup
from zenocap.services.integrator.rate_reports import RateSetup
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState

LATE, SECONDS, START_NS = "cam02", 75, 10**18


def silhouettes(one: Walker, name: str, delay_s: float, fps: float) -> Iterator[Silhouette]:
    """Silhouettes of a camera; the walk is continued backwards at its end, and forwards at its beginning."""
    times = np.arange(int(SECONDS * fps)) / fps
    length_s = one.motion.duration_s
    moments = length_s - np.abs(np.maximum(0.0, times - delay_s) % (2 * length_s) - length_s)
    for k, (time_s, mask) in enumerate(zip(times, one.film(name, moments), strict=True)):
        region, data = pack(mask)
        yield Silhouette(
            frame=k, captured_ns=START_NS + round(1e9 * time_s), viewer=name, size=one.cameras[name].size, region=region,
            data=data,
        )  # fmt: skip


def row(seed: int, views: int, frames: float, fps: float) -> str:
    one = walker(seed, views)
    frame_ns = round(1e9 / fps)
    rate = RateSetup(tuple(one.cameras), fps, has_tracker=True)
    setup = TimekeeperSetup(rate, DelaySetup(one.cameras, frame_ns, follow=True))
    state, estimates, longest_ns, total_ns, now_ns = TimekeeperState(), list[tuple[float, CameraDelays]](), 0, 0, START_NS
    films = zip(*(silhouettes(one, name, frames / fps * (name == LATE), fps) for name in one.cameras), strict=True)
    second = 0
    for seen in films:
        now_ns = seen[0].captured_ns
        events: list[Envelope | Tick] = [
            Envelope(SILHOUETTE.at("r", viewer=its.viewer), SILHOUETTE, its, now_ns) for its in seen
        ]
        if (now_ns - START_NS) // 10**9 > second:
            second += 1
            events.append(Tick(now_ns))
        for event in events:
            began_ns = process_time_ns()
            state, messages = timekeeper.step(setup, state, event)
            spent_ns = process_time_ns() - began_ns
            longest_ns, total_ns = max(longest_ns, spent_ns), total_ns + spent_ns
            estimates += [((now_ns - START_NS) / 1e9, its) for its in messages if isinstance(its, CameraDelays)]
        if estimates and estimates[-1][1].applied_ms == state.delays.target != {}:
            break
    last = estimates[-1][1] if estimates else None
    if last is None or len(last.found_ms) < views:
        return f"{views:5} {frames:7.1f} {seed:5}   not certain"
    error = last.found_ms[LATE] * fps / 1e3 - frames
    others = max(ms for name, ms in last.found_ms.items() if name != LATE) * fps / 1e3
    applied = estimates[-1][1].applied_ms
    corrected = (
        f"{applied[LATE] * fps / 1e3 - frames:+10.2f} {estimates[-1][0]:8.0f}" if applied else f"{'none':>10} {'':8}"
    )
    cost = f"{longest_ns / 1e6:9.0f} {total_ns / (now_ns - START_NS):8.3f}"
    return f"{views:5} {frames:7.1f} {seed:5} {error:+8.2f} {others:8.2f} {corrected} {cost}"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", default="0.3,1,2,5", help="delays of the second camera, frame periods")
    parser.add_argument("--views", default="2", help="numbers of cameras")
    parser.add_argument("--seeds", type=int, default=5, help="number of people")
    parser.add_argument("--first-seed", type=int, default=20)
    parser.add_argument("--fps", type=float, default=30.0)
    options = parser.parse_args(arguments)
    print("views  frames  seed    found   others  corrected  after, s  step, ms  share")
    delays = [float(one) for one in options.frames.split(",")]
    views = [int(one) for one in options.views.split(",")]
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for count, seed, frames in product(views, seeds, delays):
        print(row(seed, count, frames, options.fps), flush=True)


if __name__ == "__main__":
    main()
