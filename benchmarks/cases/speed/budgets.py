"""Budgets of speed: videos to a take, tracker and viewers in real time.

Offline: `zenocap track` of videos of 640x480, both passes, from the first frame set to the complete take, and the first
pass alone.  Real time: silhouettes in memory to pose, 30 frame sets a second, also beside processes that never wait.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np

from benchmarks.cases import clips
from benchmarks.cases.speed.busy import busy_processes
from benchmarks.harness.case import SHARED, Case, Figures, Kind, Quantity, case
from benchmarks.people.films import posture_film, size_of
from benchmarks.people.session import frame_sets, rig_of
from zenocap.common.messages import Message
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Service
from zenocap.common.session.session import Session
from zenocap.common.topics import TOPICS
from zenocap.services.tracker import tracking
from zenocap.services.tracker.jit_warmup import load_compiled
from zenocap.services.viewer.frame import Frame
from zenocap.tools.parameters import EPOCH_NS
from zenocap.tools.takes.both_ways import add_both_ways
from zenocap.tools.takes.members import members
from zenocap.tools.takes.track import TrackedFrameSet, track

CLIPS = {7: "walk7", 4: "walk7", 3: "walk7", 2: "walk2"}
PERIOD_S = 1 / 30  # of frame sets in real time
POSTURES = ("march", "raise-both-arms-bent", "squat", "kick-right")
OFFLINE, REAL_TIME, VIEWER = "offline", "real time", "viewer"
Step = Callable[[object, object, object], tuple[object, Sequence[Message]]]


def run(one: Case) -> Figures:
    """One measurement.  Options: views, jobs, busy, size, method, postures, budget."""
    found = {OFFLINE: offline, REAL_TIME: real_time, VIEWER: viewer}[one.film](one)
    budget = one.option("budget", 0.0)
    return found | ({"budget": budget} if budget else {})


def offline(one: Case) -> dict[str, float]:
    """Frame sets per second and processor time of each, of both passes and of the first one."""
    views = one.option("views", 7)
    rig = load_rig(SHARED / "clips" / CLIPS[views])
    if CLIPS[views] == "walk7" and clips.RINGS[views]:
        names = {f"cam{k:02d}" for k in clips.RINGS[views]}
        rig = replace(rig, viewers=tuple(each for each in rig.viewers if each.id in names))
    times: list[tuple[float, float]] = []

    def note(_: TrackedFrameSet) -> None:
        times.append((time.perf_counter(), time.process_time()))

    with TemporaryDirectory() as folder:
        take = Path(folder) / "take.mcap"
        track(rig, take, note, one.option("jobs", 2))
        first = (np.array(times[-1]) - times[0]) / (len(times) - 1)
        ended = time.perf_counter(), time.process_time()
        add_both_ways(rig, take, jobs=one.option("jobs", 2))
        both = first + (np.array((time.perf_counter(), time.process_time())) - ended) / len(times)
    return {
        "both passes": float(1 / both[0]),
        "first pass": float(1 / first[0]),
        "processor": float(1e3 * both[1]),
        "processor, first pass": float(1e3 * first[1]),
    }


def real_time(one: Case) -> dict[str, float]:
    """Times of a frame set of the motion at a fixed rate, ms."""
    views = one.option("views", 7)
    clip_case = case(CLIPS[views], views=views if CLIPS[views] == "walk7" else 7)
    clip = clips.film_of(clip_case)
    setup = clips.setup_of(clip_case, clip)
    load_compiled(setup)
    state, spent = tracking.initial_state(setup), []
    with busy_processes(one.option("busy", 0)):
        due_s = time.perf_counter()
        for instant in clip.instants:
            masks = clip.masks(instant, setup.cameras)
            if instant.frame >= clip.motion_from:
                due_s = max(due_s + PERIOD_S, time.perf_counter())
                time.sleep(max(0.0, due_s - time.perf_counter()))
            started = time.perf_counter(), time.process_time()
            state, outcome = tracking.track(setup, state, instant.captured_ns, masks)
            if outcome.pose is not None:
                spent.append((time.perf_counter() - started[0], time.process_time() - started[1]))
    return _times(np.array(spent))


def viewer(one: Case) -> dict[str, float]:
    """Times of a viewer's steps for a frame: colour image to silhouette; with two-view or both, to partial BAP."""
    method, spent = one.option("method", "two-view"), list[tuple[float, float]]()
    for posture in POSTURES[: one.option("postures", len(POSTURES))]:
        film = posture_film(0, posture, size=size_of(one.option("size", "160x120")))
        rig = rig_of(film.cameras, FirstFrames(film.empty), film.fps, method)
        watch = [0.0, 0.0]
        session = Session(rig.name, ManualClock(EPOCH_NS), [_timed(each, watch) for each in members(rig)], TOPICS)
        for number, frames in enumerate(frame_sets(film)):
            watch[:] = [0.0, 0.0]
            session.frames(frames)
            if number >= film.motion_from:
                spent.append((watch[0] / len(film.cameras), watch[1] / len(film.cameras)))
    return _times(np.array(spent))


def _timed(service: Service[object, object, Frame], watch: list[float]) -> Service[object, object, Frame]:
    """The service, with the time of its steps added to `watch`: wall and processor; of viewers only."""
    if service.name != "viewer":
        return service
    step = cast(Step, service.step)

    def timed(setup: object, state: object, event: object) -> tuple[object, Sequence[Message]]:
        started = time.perf_counter(), time.process_time()
        result = step(setup, state, event)
        watch[0] += time.perf_counter() - started[0]
        watch[1] += time.process_time() - started[1]
        return result

    return replace(service, step=timed)


def _times(spent: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> dict[str, float]:
    """spent: (n, 2) wall and processor time, seconds."""
    wall, processor = 1e3 * np.median(spent, axis=0)
    return {"wall": float(wall), "p99": float(np.percentile(1e3 * spent[:, 0], 99)), "processor": float(processor)}


BUDGETS = Kind(
    "budgets",
    "Videos of 640×480 to a take, frame sets a second with both passes and with the first alone; the tracker in real "
    "time, 30 frame sets/s, silhouettes to pose, alone and beside processes that never wait; one frame of a viewer.",
    run,
    (
        Quantity("both passes", "frames/s", 0, "low", "median"),
        Quantity("first pass", "frames/s", 0, "low", "median"),
        Quantity("wall", "ms", 1, joined="median"),
        Quantity("p99", "ms", 0, joined="median"),
        Quantity("processor", "ms", 1, joined="median"),
        Quantity("processor, first pass", "ms", 1, joined="median"),
        Quantity("budget", "", 1, ""),
    ),
    {
        f"{views} views, videos to a take, {jobs} jobs": case(
            OFFLINE, views=views, jobs=jobs, **({"budget": budget} if jobs == 2 else {})
        )
        for views, budget in ((7, 45.0), (4, 60.0), (2, 80.0))
        for jobs in (1, 2)
    }
    | {
        f"{views} views, real time{', beside 2 processes' if busy else ''}": case(
            REAL_TIME, views=views, busy=busy, **({"budget": 15.0 if busy else 6.0} if views == 7 else {})
        )
        for views in (7, 4, 2)
        for busy in (0, 2)
    }
    | {
        "viewer, two-view, 160×120": case(VIEWER, budget=1.5),
        "viewer, silhouette, 160×120": case(VIEWER, method="hybrid"),
        "viewer, both, 160×120": case(VIEWER, method="both"),
        "viewer, two-view, 640×480": case(VIEWER, size="640x480"),
        "viewer, silhouette, 640×480": case(VIEWER, size="640x480", method="hybrid", budget=0.8),
        "viewer, both, 640×480": case(VIEWER, size="640x480", method="both"),
    },
    case(VIEWER, postures=1),
    rows="what",
    timed=True,
    inputs=lambda one: () if one.film == VIEWER else (f"clips/{CLIPS[one.option('views', 7)]}",),
)
