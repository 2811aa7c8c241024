"""Run rigs, started in random order, and apply the faults one after another."""

import os
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.faults.measures import Figures, Window, figures
from benchmarks.faults.network import Network
from benchmarks.faults.running_rig import INTEGRATOR, OBSERVER, ROUTER, RigError, RunningRig, rig_file
from benchmarks.faults.scenarios import Fault
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import Take
from zenocap.tools.verify.recompute import verify
from zenocap.tools.verify.result import Verification
from zenocap.tools.verify.take_messages import DERIVED, messages_of

SETTLED_S = 5.0  # duration of poses from all viewers before the next fault (s)
PATIENCE_S = 90.0  # until the first pose (s): compilation, empty scene, initial posture
FPS = 15.0
LATE_S = 45.0  # observation is continued at most so long for a rig that has not recovered, as on a busy machine (s)
BETWEEN_S = 0.4  # between the starts of two services (s)
SERVICES = {
    "two-view": (ROUTER, INTEGRATOR, "viewer-1", "viewer-2", "recognizer", "animator"),
    "hybrid": (ROUTER, INTEGRATOR, "tracker", "viewer-1", "viewer-2", "viewer-3", "recognizer", "animator"),
}


@dataclass(frozen=True)
class Result:
    """Result of one fault.  fault: its name.  figures: None when the rig did not recover."""

    fault: str
    seconds: float
    figures: Figures | None


@dataclass(frozen=True)
class Started:
    """Start of a rig.  order: of the services.  seconds: from the last start to continuous poses from all viewers."""

    method: str
    order: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class Log:
    """A take of the run, recomputed.  unchecked: derived messages that cannot be recomputed, because their inputs were
    published while a link was cut, or before this take began.  remark: reason why nothing could be verified.
    """

    name: str
    equal: int
    different: int
    unchecked: int
    remark: str = ""


@dataclass(frozen=True)
class Outcome:
    started: tuple[Started, ...]
    results: tuple[Result, ...]
    logs: tuple[Log, ...]

    @property
    def passed(self) -> bool:
        """Whether every rig recovered and every log verifies."""
        recovered = all(result.figures and result.figures.recovered_s is not None for result in self.results)
        return recovered and not any(log.different for log in self.logs)


def run(faults: Sequence[Fault], folder: Path, report_line: Callable[[str], None], seed: int = 0) -> Outcome:
    """Apply all faults, each to a running rig of its method.  folder: for takes and logs.  seed: of the start orders."""
    rng = random.Random(seed)
    started: list[Started] = []
    results: list[Result] = []
    logs: list[Log] = []
    for method in dict.fromkeys(fault.method for fault in faults):
        wanted = [fault for fault in faults if fault.method == method]
        take_folder = folder / method
        while wanted:
            take_folder.mkdir(parents=True, exist_ok=True)
            wanted = _run_rig(method, wanted, take_folder, rng, started, results, report_line)
            logs += [_verified_log(take) for take in sorted(take_folder.glob("*.mcap"))]
            take_folder = take_folder.with_name(f"{take_folder.name}-again")
    return Outcome(tuple(started), tuple(results), tuple(logs))


def _run_rig(
    method: str,
    faults: Sequence[Fault],
    folder: Path,
    rng: random.Random,
    started: list[Started],
    results: list[Result],
    report_line: Callable[[str], None],
) -> list[Fault]:
    """Run one rig until a fault that it does not survive; return the remaining faults."""
    services = list(SERVICES[method])
    viewers = sum(name.startswith("viewer") for name in services)
    with Network([*services, OBSERVER], f"zc{os.getpid()}") as network:
        rig = rig_file(folder, "faults", method, viewers, FPS, network.address(ROUTER))
        with RunningRig(network, folder, rig, "faults", FPS) as running:
            running.start(OBSERVER)
            rng.shuffle(services)
            for name in services:
                running.start(name)
                time.sleep(BETWEEN_S)
            begin_ns = time.time_ns()
            seconds = running.wait(lambda: running.settled_since(begin_ns), PATIENCE_S, "the first poses")
            started.append(Started(method, tuple(services), seconds))
            report_line(f"{method}: poses {seconds:.1f} s after the last start; order: {', '.join(services)}")
            for number, fault in enumerate(faults):
                result = _apply_fault(running, fault)
                results.append(result)
                report_line(f"{fault.name}: {result.figures}")
                if result.figures is None or result.figures.recovered_s is None:
                    return list(faults[number + 1 :])
    return []


def _apply_fault(running: RunningRig, fault: Fault) -> Result:
    try:
        ready_ns = time.time_ns()
        running.wait(lambda: running.settled_since(ready_ns), PATIENCE_S, "before the fault")
        time.sleep(SETTLED_S)
        begin_ns = time.time_ns()
        fault.begin(running)
        if fault.settle:
            since_ns = time.time_ns()
            running.wait(lambda: running.settled_since(since_ns), PATIENCE_S, fault.name)
            time.sleep(1.0)
            begin_ns = time.time_ns()
        time.sleep(fault.seconds)
        end_ns = time.time_ns()
        fault.end(running)
        time.sleep(fault.after_s)
        late_s = time.monotonic() + LATE_S
        while not running.settled_since(end_ns) and time.monotonic() < late_s:
            time.sleep(0.1)
        window = Window(begin_ns, end_ns, time.time_ns())
        fault.repair(running)
    except RigError:
        return Result(fault.name, fault.seconds, None)
    return Result(fault.name, fault.seconds, figures(list(running.received), window, running.fps, fault.affected))


def _verified_log(take: Path) -> Log:
    """Verify a take: gaps are allowed, differing messages are not.  Raises UserError."""
    derived = sum(isinstance(received.message, DERIVED) for received in messages_of(Take(take)))
    try:
        found: Verification = verify([take])
    except UserError as error:
        return Log(take.name, 0, 0, derived, str(error).partition(": ")[2])
    return Log(take.name, found.equal.total(), found.different.total(), found.unchecked.total())


__all__ = ["INTEGRATOR", "Log", "Outcome", "Result", "Started", "run"]
