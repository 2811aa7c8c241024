"""Rigs started in any order, and the faults that happen to them one after another."""

import os
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from common.take.reading import Take, TakeError
from services.takes.verify.memory import DERIVED
from services.takes.verify.parts import ours
from services.takes.verify.recompute import Verified, verify
from tests.evaluation.faults.measures import Figures, Window, figures
from tests.evaluation.faults.network import Network
from tests.evaluation.faults.scenarios import Fault
from tests.evaluation.faults.stage import INTEGRATOR, OBSERVER, ROUTER, Stage, StageError, rig_file

SETTLED_S = 5.0  # poses of all viewers for so long before the next fault
PATIENCE_S = 90.0  # for the first pose: compiling, the empty scene, the initial posture
FPS = 15.0
BETWEEN_S = 0.4  # starts
SERVICES = {
    "two-view": (ROUTER, INTEGRATOR, "viewer-1", "viewer-2", "recognizer", "animator"),
    "hybrid": (ROUTER, INTEGRATOR, "tracker", "viewer-1", "viewer-2", "viewer-3", "recognizer", "animator"),
}


@dataclass(frozen=True)
class Result:
    """fault: its name.  figures: None when the rig never came back."""

    fault: str
    seconds: float
    figures: Figures | None


@dataclass(frozen=True)
class Started:
    """order: of the services.  seconds: from the last start to poses of all viewers that go on."""

    method: str
    order: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class Log:
    """A take of the run, recomputed.  unchecked: derived messages of services that cannot be followed, because what they
    were fed was said while a link was cut, or before this take began.  remark: why nothing could be.
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
    def well(self) -> bool:
        """Whether everything came back, and no log has anything that was not said."""
        back = all(result.figures and result.figures.recovered_s is not None for result in self.results)
        return back and not any(log.different for log in self.logs)


def run(faults: Sequence[Fault], folder: Path, tell: Callable[[str], None], seed: int = 0) -> Outcome:
    """All faults, each on a running rig of its method.  folder: for takes and logs.  seed: of the orders of starting."""
    chance = random.Random(seed)
    started: list[Started] = []
    results: list[Result] = []
    logs: list[Log] = []
    for method in dict.fromkeys(fault.method for fault in faults):
        wanted = [fault for fault in faults if fault.method == method]
        place = folder / method
        while wanted:
            place.mkdir(parents=True, exist_ok=True)
            wanted = _rehearse(method, wanted, place, chance, started, results, tell)
            logs += [_log(take) for take in sorted(place.glob("*.mcap"))]
            place = place.with_name(f"{place.name}-again")
    return Outcome(tuple(started), tuple(results), tuple(logs))


def _rehearse(
    method: str,
    faults: Sequence[Fault],
    folder: Path,
    chance: random.Random,
    started: list[Started],
    results: list[Result],
    tell: Callable[[str], None],
) -> list[Fault]:
    """One rig, until a fault that it does not survive; returns those that are left for another."""
    services = list(SERVICES[method])
    viewers = sum(name.startswith("viewer") for name in services)
    with Network([*services, OBSERVER], f"zc{os.getpid()}") as network:
        rig = rig_file(folder, "faults", method, viewers, FPS, network.address(ROUTER))
        with Stage(network, folder, rig, "faults", FPS) as stage:
            stage.start(OBSERVER)
            chance.shuffle(services)
            for name in services:
                stage.start(name)
                time.sleep(BETWEEN_S)
            begin_ns = time.time_ns()
            seconds = stage.wait(lambda: stage.settled_since(begin_ns), PATIENCE_S, "the first poses")
            started.append(Started(method, tuple(services), seconds))
            tell(f"{method}: poses {seconds:.1f} s after the last start; order: {', '.join(services)}")
            for number, fault in enumerate(faults):
                result = _suffer(stage, fault)
                results.append(result)
                tell(f"{fault.name}: {result.figures}")
                if result.figures is None or result.figures.recovered_s is None:
                    return list(faults[number + 1 :])
    return []


def _suffer(stage: Stage, fault: Fault) -> Result:
    try:
        ready_ns = time.time_ns()
        stage.wait(lambda: stage.settled_since(ready_ns), PATIENCE_S, "before the fault")
        time.sleep(SETTLED_S)
        begin_ns = time.time_ns()
        fault.begin(stage)
        if fault.settle:
            since_ns = time.time_ns()
            stage.wait(lambda: stage.settled_since(since_ns), PATIENCE_S, fault.name)
            time.sleep(1.0)
            begin_ns = time.time_ns()
        time.sleep(fault.seconds)
        end_ns = time.time_ns()
        fault.end(stage)
        time.sleep(fault.after_s)
        window = Window(begin_ns, end_ns, time.time_ns())
        fault.tidy(stage)
    except StageError:
        return Result(fault.name, fault.seconds, None)
    return Result(fault.name, fault.seconds, figures(list(stage.heard), window, stage.fps, fault.concerned))


def _log(take: Path) -> Log:
    """Recompute a take: an outage may leave a gap in it, but nothing that the services did not say.  Raises TakeError."""
    derived = sum(isinstance(received.message, DERIVED) for received in ours(Take(take)))
    try:
        found: Verified = verify([take])
    except TakeError as error:
        return Log(take.name, 0, 0, derived, str(error).partition(": ")[2])
    return Log(take.name, found.equal.total(), found.different.total(), found.unchecked.total())


__all__ = ["INTEGRATOR", "Log", "Outcome", "Result", "Started", "run"]
