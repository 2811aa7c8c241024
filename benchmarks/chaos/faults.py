"""One fault at a time against a rig: effect on the other services, and time to recovery."""

import random
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from benchmarks.chaos.injection import Injector
from benchmarks.chaos.measures import FaultWindow, figures, recovery_ns
from benchmarks.chaos.observer import Observer, settled_ns
from benchmarks.chaos.running_rig import START_S, RunningRig, rig_file
from benchmarks.chaos.schedule import ANIMATOR, INTEGRATOR, RECOGNIZER, ROUTER, SERVICES, TRACKER, Fault
from benchmarks.chaos.takes import content, dishonest
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case

RIG, SIZE, FPS = "faults", "160x120", 15.0
LATE_S = 45.0  # observation of a rig that has not recovered
SETTLED_S = 3.0  # of poses from all viewers before the fault
AFTER_S = 8.0  # shortest observation after it


def run(one: Case) -> Figures:
    """One fault.  film: its kind.  Options: target, seconds, method."""
    fault = Fault(one.film, one.option("target", INTEGRATOR), one.option("seconds", 0.0))
    with tempfile.TemporaryDirectory() as folder:
        return measured(fault, one.option("method", "hybrid"), one.seed, Path(folder))


def measured(fault: Fault, method: str, seed: int, folder: Path) -> dict[str, float]:
    """Figures of a fault, and the number of takes that `info` or `verify` describe wrongly.  Raises RuntimeError."""
    viewers = ["1", "2"] if method == "two-view" else ["1", "2", "3"]
    with ExitStack() as stack:
        rig = stack.enter_context(RunningRig(folder, folder / "takes", rig_file(folder, RIG, SIZE, FPS, seed, method)))
        observer = Observer(rig.endpoint, RIG, viewers, SERVICES, frames=True)
        observer.start()
        stack.callback(observer.close)
        if not rig.wait(lambda: settled_ns(observer.poses, 0, len(viewers)) is not None, START_S):
            raise RuntimeError(f"the rig does not track within {START_S:g} s: {rig.log_text()[-2000:]}")
        time.sleep(SETTLED_S)
        injector = Injector(rig, RIG, observer, None)
        begin_fault = injector.prepare(fault, random.Random(seed))
        begin_ns = time.time_ns()
        end_fault = begin_fault()
        time.sleep(fault.seconds)
        end_fault()
        end_ns = time.time_ns()
        time.sleep(AFTER_S)
        rig.wait(lambda: settled_ns(observer.poses, end_ns, len(viewers)) is not None, LATE_S)
        window = FaultWindow(begin_ns, max(end_ns, begin_ns + 1), time.time_ns())
        rig.stop()
        observer.close()
        takes = [content(path) for path in sorted((folder / "takes").glob("*.mcap"))]
        problems = [text for take in takes for text in dishonest(take, forged=False)]
    for problem in problems:
        print(f"fault: {problem}")
    if recovery_ns(observer.poses, window, len(viewers)) is None:
        print(f"fault: {fault.name}: no poses of all viewers within {LATE_S:g} s")
    affected = [fault.target.removeprefix("viewer ")] if fault.target.startswith("viewer") else []
    if fault.target == ROUTER:
        affected = viewers
    found = figures(observer.poses, observer.frames, window, FPS, affected)
    return found | {"takes": len(takes), "wrong takes": len(problems)}


_CUTS = [("cut", target, seconds) for target in ("viewer 2", INTEGRATOR) for seconds in (1.0, 4.0, 15.0)]
_STOPS = [("stop", target, 5.0) for target in ("viewer 2", INTEGRATOR, ROUTER, ANIMATOR)]
_KILLS = [("kill", target, 0.0) for target in ("viewer 2", INTEGRATOR, ROUTER, RECOGNIZER, ANIMATOR)]
FAULTS = Kind(
    "faults",
    "A rig of simulated cameras at 160×120 and 15 frames/s that `zenocap up` runs around a router: two viewers of "
    "`two-view`, three of `hybrid`. Links are cut by a forwarder. Poses, whole: of those due during the fault, and of "
    "those with all viewers; others: frames of viewers that are not affected; recovered: from the end of the fault to "
    "continuous poses of all viewers.",
    run,
    (
        *(Quantity(name, "%", 0, "low") for name in ("poses", "whole", "others")),
        Quantity("gap", "s", 1),
        Quantity("recovered", "s", 1),
        *(Quantity(name, "frames", 0) for name in ("lost", "other lost")),
        *(Quantity(name, "", 0, joined="sum") for name in ("takes", "wrong takes")),
    ),
    {
        f"{kind} {target}{f' for {seconds:g} s' if seconds else ''}, {method}": case(
            kind, target=target, seconds=seconds, method=method
        )
        for method in ("two-view", "hybrid")
        for kind, target, seconds in (*_CUTS, *_STOPS, *_KILLS, *([("kill", TRACKER, 0.0)] if method == "hybrid" else []))
    },
    case("stop", target="viewer 2", seconds=1.0, method="two-view"),
    rows="fault, method",
    timed=True,
)
