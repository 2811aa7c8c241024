"""Delays of cameras as the integrator of a running rig finds and corrects them.

Simulated people walk to and fro on a figure of eight, seen in 320 x 240 with ragged edges by calibrated cameras; the second
camera's images are older than their times by some frame periods.  The step of the integrator gets the silhouettes and a
tick each second, as live, with `delays = "follow"`.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from tests.support.built_messages import silhouette
from tests.support.walkers import Walker, walker
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.messages import CameraDelays, Silhouette
from zenocap.common.topics import SILHOUETTE
from zenocap.services.integrator import timekeeper
from zenocap.services.integrator.camera_delays import DelaySetup
from zenocap.services.integrator.rate_reports import RateSetup
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState

FIRST_PERSON = 20
LATE, SECONDS, START_NS = "cam02", 75, 10**18


def silhouettes(one: Walker, name: str, delay_s: float, fps: float) -> Iterator[Silhouette]:
    """Silhouettes of a camera; the walk is continued backwards at its end, and forwards at its beginning."""
    times = np.arange(int(SECONDS * fps)) / fps
    length_s = one.motion.duration_s
    moments = length_s - np.abs(np.maximum(0.0, times - delay_s) % (2 * length_s) - length_s)
    for k, (time_s, mask) in enumerate(zip(times, one.film(name, moments), strict=True)):
        yield silhouette(name, k, START_NS + round(1e9 * time_s), mask)


def run(one: Case) -> Figures:
    """One person.  Options: frames, the delay in frame periods; views; fps."""
    views, frames, fps = one.option("views", 2), one.option("frames", 1.0), one.option("fps", 30.0)
    subject = walker(FIRST_PERSON + one.seed, views)
    rate = RateSetup(tuple(subject.cameras), fps, has_tracker=True)
    setup = TimekeeperSetup(rate, DelaySetup(subject.cameras, round(1e9 / fps), follow=True))
    state, estimates, second = TimekeeperState(), list[tuple[float, CameraDelays]](), 0
    films = [silhouettes(subject, name, frames / fps * (name == LATE), fps) for name in subject.cameras]
    for seen in zip(*films, strict=True):
        now_ns = seen[0].captured_ns
        events: list[Envelope | Tick] = [
            Envelope(SILHOUETTE.at("r", viewer=its.viewer), SILHOUETTE, its, now_ns) for its in seen
        ]
        if (now_ns - START_NS) // 10**9 > second:
            second += 1
            events.append(Tick(now_ns))
        for event in events:
            state, messages = timekeeper.step(setup, state, event)
            estimates += [((now_ns - START_NS) / 1e9, its) for its in messages if isinstance(its, CameraDelays)]
        if estimates and estimates[-1][1].applied_ms == state.delays.target != {}:
            break
    if not estimates or len(estimates[-1][1].found_ms) < views:
        return {"not certain": 1}
    after_s, last = estimates[-1]
    periods = fps / 1e3  # of a millisecond
    found = {
        "found": abs(last.found_ms[LATE] * periods - frames),
        "others": max(abs(ms) for name, ms in last.found_ms.items() if name != LATE) * periods,
    }
    if last.applied_ms:
        found |= {"corrected": abs(last.applied_ms[LATE] * periods - frames), "after": after_s}
    return found


LIVE_DELAYS = Kind(
    "live-delays",
    "One of the cameras of a running rig is late by some frame periods: error of the last estimate, largest delay of "
    "another camera, error of what the tracker subtracts in the end, and the time from the first silhouette until then; "
    "simulated people who walk, five of them.",
    run,
    (
        Quantity("found", "periods", 2),
        Quantity("others", "periods", 2),
        Quantity("corrected", "periods", 2),
        Quantity("after", "s", 0),
        Quantity("not certain", "", 0, joined="sum"),
    ),
    {
        f"{frames:g} periods, {views} views": case("walk", frames=frames, views=views)
        for views in (2, 4)
        for frames in (0.3, 1.0, 2.0, 5.0)
    },
    case("walk", fps=15.0),
    seeds=5,
    rows="late by, cameras",
)
