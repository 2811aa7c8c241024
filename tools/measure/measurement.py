"""One measurement: start the processes, wait for the first poses, warm up, measure, stop."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from zenocap.tools.measure.latency import DueWindow, Figures, figures
from zenocap.tools.measure.load_plan import LoadError, Plan
from zenocap.tools.measure.load_processes import Deployment, LoadProcesses
from zenocap.tools.measure.resources import (
    ITSELF,
    Cost,
    Machine,
    MachineUse,
    ProcessKey,
    ProcessSample,
    bottleneck,
    cores,
    costs,
    machine,
    sample,
)
from zenocap.tools.measure.subscriber import LoadSubscriber

STARTING_S, STARTING_EACH_S = 60.0, 3.0  # longest wait for the first poses: constant, and per process
LATE_S = 1.0  # time for frames that were due in the window and have not arrived yet
POLL_S = 0.25
MOST_STATES = 12  # of services in an error text

ReportProgress = Callable[[str, float], None]  # current activity, and its progress from 0 to 1


@dataclass(frozen=True)
class Measurement:
    """Result for a plan.  ready_s: time from the start to the first complete frame set of every rig.

    seconds: measured time; shorter than planned after an interruption.  dropped: messages that the subscriber dropped.
    """

    plan: Plan
    figures: Figures
    costs: tuple[Cost, ...]
    used: MachineUse
    ready_s: float
    seconds: float
    dropped: int

    @property
    def held(self) -> bool:
        return self.figures.held(self.plan.period_s)

    @property
    def bottleneck(self) -> str:
        return bottleneck(self.plan, self.figures, self.costs, self.used)


@contextmanager
def running(
    plan: Plan, deployment: Deployment, stopped: Callable[[], bool], report: ReportProgress
) -> Iterator[tuple[LoadProcesses, LoadSubscriber, int]]:
    """Start everything and wait for the first complete frame set of every rig; stop everything on exit.

    Yields the processes, the measuring subscriber, and the capture time of frame 0.  Raises LoadError and BusError.
    """
    epoch_ns = time.time_ns()
    processes = LoadProcesses(plan, deployment, epoch_ns)
    try:
        processes.start()
        with LoadSubscriber(plan, processes.own, stopped) as subscriber:
            _wait_until_ready(plan, processes, subscriber, stopped, report)
            yield processes, subscriber, epoch_ns
    finally:
        report("stopping", 1.0)
        processes.stop()


def measure_plan(plan: Plan, deployment: Deployment, stopped: Callable[[], bool], report: ReportProgress) -> Measurement:
    """Measure a plan.  Raises LoadError without a pose or when a process fails; BusError without a network."""
    started_s = time.monotonic()
    with running(plan, deployment, stopped, report) as (processes, subscriber, epoch_ns):
        ready_s = time.monotonic() - started_s
        receive(processes, subscriber, plan.settle_s, stopped, lambda share: report("settling", share))
        pids: dict[ProcessKey, int] = {**processes.pids(), ITSELF: os.getpid()}
        before, all_before, start_ns = sample(pids), machine(), subscriber.now_ns
        receive(processes, subscriber, plan.seconds, stopped, lambda share: report("measuring", share))
        after, all_after, end_ns = sample(pids), machine(), subscriber.now_ns
        if not stopped():
            subscriber.receive_for(LATE_S)
        else:
            end_ns = max(start_ns, end_ns - int(2e9 * plan.period_s))  # the last frames have not arrived yet
        window = DueWindow(epoch_ns, plan.rate, start_ns, end_ns)
        found = figures(subscriber.arrivals, window, plan.rig_names, plan.viewers)
        each = costs(before, after, subscriber.health_between(start_ns, end_ns))
        used = machine_use(before, after, all_before, all_after)
        return Measurement(plan, found, each, used, ready_s, window.seconds, subscriber.dropped)


def machine_use(
    before: dict[ProcessKey, ProcessSample], after: dict[ProcessKey, ProcessSample], all_before: Machine, all_after: Machine
) -> MachineUse:
    """Use of the machine between two samples.  Processes that started or ended in between count as others."""
    same = [key for key in after if key in before and before[key].pid == after[key].pid]
    own_s = sum(after[key].processor_s - before[key].processor_s for key in same)
    elapsed_s = max(1e-9, (all_after.all_s - all_before.all_s) / cores())
    others_s = max(0.0, all_after.processor_s - all_before.processor_s - own_s)
    return MachineUse(cores(), own_s / elapsed_s, others_s / elapsed_s)


def _wait_until_ready(
    plan: Plan, processes: LoadProcesses, subscriber: LoadSubscriber, stopped: Callable[[], bool], report: ReportProgress
) -> None:
    longest_s = STARTING_S + STARTING_EACH_S * len(processes.specs)
    end_s = time.monotonic() + longest_s
    while not stopped():
        ready = [name for name in plan.rig_names if subscriber.arrivals.whole.get(name)]
        report(f"starting {len(processes.specs)} processes, {len(ready)} of {plan.rigs} rigs ready", len(ready) / plan.rigs)
        if len(ready) == plan.rigs:
            return
        if time.monotonic() > end_s:
            missing = [name for name in plan.rig_names if name not in ready]
            states = "".join(f"\n{text}" for text in subscriber.texts(missing)[:MOST_STATES])
            raise LoadError(f"no pose of {', '.join(missing)} within {longest_s:.0f} s{states}{_process_output(processes)}")
        _poll(processes, subscriber)


def receive(
    processes: LoadProcesses, subscriber: LoadSubscriber, seconds: float, stopped: Callable[[], bool],
    report: Callable[[float], None] = lambda share: None,
) -> None:  # fmt: skip
    """Receive messages for a number of seconds while all processes run.  Raises LoadError when one fails."""
    start_s = time.monotonic()
    while not stopped() and (elapsed_s := time.monotonic() - start_s) < seconds:
        report(elapsed_s / seconds)
        _poll(processes, subscriber, min(POLL_S, seconds - elapsed_s))


def _poll(processes: LoadProcesses, subscriber: LoadSubscriber, seconds: float = POLL_S) -> None:
    subscriber.receive_for(seconds)
    processes.poll()
    if processes.failed:
        raise LoadError(f"{', '.join(processes.failed)} failed{_process_output(processes)}")


def _process_output(processes: LoadProcesses) -> str:
    lines = processes.lines()[-12:]
    return "; output of the processes:\n" + "\n".join(lines) if lines else ""
