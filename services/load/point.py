"""One measurement: start everything, wait until poses come, let it settle, measure, stop everything."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from services.load.costs import Cost, Used, bottleneck, costs
from services.load.crew import Crew
from services.load.heard import Figures, Window, figures
from services.load.listening import Listening
from services.load.plan import LoadError, Plan
from services.load.processes import ITSELF, Machine, Sample, Who, cores, machine, sample

STARTING_S, STARTING_EACH_S = 60.0, 3.0  # longest wait for the first poses: for all, and for each process
LATE_S = 1.0  # for what was due in the window and is still on its way
LOOK_S = 0.25

Tell = Callable[[str, float], None]  # what is being done, and how far it is, 0 to 1


@dataclass(frozen=True)
class Setting:
    """Where a plan's rigs are, and how its services meet.  takes: folder of the takes that nobody keeps."""

    rigs: tuple[Path, ...]
    takes: Path
    connect: tuple[str, ...] = ()
    config: Path | None = None


@dataclass(frozen=True)
class Point:
    """What was measured of a plan.  ready_s: from the start to the first whole instant of every rig.

    seconds: really measured; fewer than planned when it was stopped.  unheard: messages that the measuring missed.
    """

    plan: Plan
    figures: Figures
    costs: tuple[Cost, ...]
    used: Used
    ready_s: float
    seconds: float
    unheard: int

    @property
    def held(self) -> bool:
        return self.figures.held(self.plan.period_s)

    @property
    def bottleneck(self) -> str:
        return bottleneck(self.plan, self.figures, self.costs, self.used)


@contextmanager
def running(plan: Plan, setting: Setting, stopped: Callable[[], bool], tell: Tell) -> Iterator[tuple[Crew, Listening, int]]:
    """Everything started and every rig's first whole instant heard; stopped afterwards, whatever happens.

    Gives the processes, the measuring subscriber, and the capture time of frame 0.  Raises LoadError and BusError.
    """
    epoch_ns = time.time_ns()
    crew = Crew(plan, setting.rigs, setting.takes, epoch_ns, setting.connect, setting.config)
    try:
        crew.start()
        with Listening(plan, crew.own, stopped) as listening:
            _wait(plan, crew, listening, stopped, tell)
            yield crew, listening, epoch_ns
    finally:
        tell("stopping", 1.0)
        crew.stop()


def measured(plan: Plan, setting: Setting, stopped: Callable[[], bool], tell: Tell) -> Point:
    """Raises LoadError when no pose comes, or a process fails; BusError when the network cannot be joined."""
    started_s = time.monotonic()
    with running(plan, setting, stopped, tell) as (crew, listening, epoch_ns):
        ready_s = time.monotonic() - started_s
        _listen(crew, listening, plan.settle_s, stopped, lambda share: tell("settling", share))
        pids: dict[Who, int] = {**crew.pids(), ITSELF: os.getpid()}
        before, all_before, start_ns = sample(pids), machine(), listening.now_ns
        _listen(crew, listening, plan.seconds, stopped, lambda share: tell("measuring", share))
        after, all_after, end_ns = sample(pids), machine(), listening.now_ns
        if not stopped():
            listening.listen(LATE_S)
        else:
            end_ns = max(start_ns, end_ns - int(2e9 * plan.period_s))  # the last ones are still on their way
        window = Window(epoch_ns, plan.rate, start_ns, end_ns)
        found = figures(listening.heard, window, plan.rig_names, plan.viewers)
        each = costs(before, after, listening.health_between(start_ns, end_ns))
        used = machine_use(before, after, all_before, all_after)
        return Point(plan, found, each, used, ready_s, window.seconds, listening.dropped)


def machine_use(before: dict[Who, Sample], after: dict[Who, Sample], all_before: Machine, all_after: Machine) -> Used:
    """The machine between two samples.  Processes that came or went in between count for the others."""
    same = [who for who in after if who in before and before[who].pid == after[who].pid]
    own_s = sum(after[who].processor_s - before[who].processor_s for who in same)
    elapsed_s = max(1e-9, (all_after.all_s - all_before.all_s) / cores())
    others_s = max(0.0, all_after.processor_s - all_before.processor_s - own_s)
    return Used(cores(), own_s / elapsed_s, others_s / elapsed_s)


def _wait(plan: Plan, crew: Crew, listening: Listening, stopped: Callable[[], bool], tell: Tell) -> None:
    longest_s = STARTING_S + STARTING_EACH_S * len(crew.posts)
    end_s = time.monotonic() + longest_s
    while not stopped():
        ready = [name for name in plan.rig_names if listening.heard.whole.get(name)]
        tell(f"starting {len(crew.posts)} processes, {len(ready)} of {plan.rigs} rigs ready", len(ready) / plan.rigs)
        if len(ready) == plan.rigs:
            return
        if time.monotonic() > end_s:
            missing = ", ".join(name for name in plan.rig_names if name not in ready)
            raise LoadError(f"no pose of {missing} within {longest_s:.0f} s{_said(crew)}")
        _look(crew, listening)


def _listen(
    crew: Crew, listening: Listening, seconds: float, stopped: Callable[[], bool], tell: Callable[[float], None]
) -> None:
    start_s = time.monotonic()
    while not stopped() and (passed_s := time.monotonic() - start_s) < seconds:
        tell(passed_s / seconds)
        _look(crew, listening, min(LOOK_S, seconds - passed_s))


def _look(crew: Crew, listening: Listening, seconds: float = LOOK_S) -> None:
    listening.listen(seconds)
    crew.poll()
    if crew.failed:
        raise LoadError(f"{', '.join(crew.failed)} failed{_said(crew)}")


def _said(crew: Crew) -> str:
    lines = crew.lines()[-12:]
    return "; the processes said:\n" + "\n".join(lines) if lines else ""
