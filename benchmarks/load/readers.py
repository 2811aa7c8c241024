"""Readers of all topics beside a rig of stand-ins: their priority changes while it runs, so that conditions are paired."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

from benchmarks.sections import Row, Section, Table

from benchmarks.load.bench import Bench
from zenocap.common.runtime.priority import NICENESS
from zenocap.tools.load_test.costs import MachineUse
from zenocap.tools.load_test.latency import Window, figures
from zenocap.tools.load_test.launch import LoadProcesses
from zenocap.tools.load_test.measurement import machine_use, running
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.load_test.processes import ITSELF, ProcessKey, machine, sample
from zenocap.tools.load_test.subscriber import LoadSubscriber

ROUNDS, SETTLE_S, CHANGED_S, LATE_S = 6, 8.0, 1.0, 0.7  # by hand
PLAN = Plan(stand_ins=True, subscribers=16, subscriber_priority="normal")
# Nice values of the readers' threads and of their sessions (`/proc/PID/autogroup`).
PRIORITIES = {"normal": (0, 0), "nice value only": (NICENESS, 0), "low": (NICENESS, NICENESS), "lowest": (19, 19)}
COLUMNS = (
    "priority of 16 readers", "p50 ms", "p99 ms, median", "p99 ms, of each round", "lost %", "readers' cores",
    "others' cores",
)  # fmt: skip


@dataclass(frozen=True)
class Phase:
    """Latencies (ms), loss and cores of one phase."""

    p50: float
    p99: float
    loss: float
    readers: float
    used: MachineUse


def readers(bench: Bench) -> Section:
    """Latency of the poses by the priority of the readers.  Linux, as root or with readers of this user."""
    found: dict[str, list[Phase]] = {name: [] for name in PRIORITIES}
    deployment = bench.session.deployment(PLAN, _quiet)
    with running(PLAN, deployment, bench.stopped, _quiet) as (processes, subscriber, epoch_ns):
        pids = {key: pid for key, pid in processes.pids().items() if key[1] == "subscriber"}
        subscriber.receive_for(SETTLE_S)
        for number in range(ROUNDS):
            for name in list(PRIORITIES) if number % 2 == 0 else list(reversed(PRIORITIES)):
                if bench.stopped():
                    break
                for pid in pids.values():
                    set_priority(pid, *PRIORITIES[name])
                subscriber.receive_for(CHANGED_S)
                found[name].append(measured_phase(PLAN, bench.seconds, processes, subscriber, epoch_ns, pids))
                print(f"round {number + 1}, {name}: {found[name][-1]}", flush=True)  # a run takes long, and may be ended
    notes = (
        f"One rig of two stand-ins at 30 frames/s; their priority changes every {bench.seconds:g} s, {ROUNDS} rounds.",
    )
    rows = tuple(_row(name, phases) for name, phases in found.items() if phases)
    return Section("readers", "Readers and their priority", notes, (Table("Readers", COLUMNS, rows),))


def measured_phase(
    plan: Plan, seconds: float, processes: LoadProcesses, subscriber: LoadSubscriber, epoch_ns: int,
    pids: Mapping[ProcessKey, int],
) -> Phase:  # fmt: skip
    """Latency, loss and cores over the next `seconds` of a running load.  pids: of the readers."""
    everything = {**processes.pids(), ITSELF: os.getpid(), **pids}
    before, all_before, start_ns = sample(everything), machine(), subscriber.now_ns
    subscriber.receive_for(seconds)
    after, all_after, end_ns = sample(everything), machine(), subscriber.now_ns
    subscriber.receive_for(LATE_S)
    of = figures(subscriber.arrivals, Window(epoch_ns, plan.rate, start_ns, end_ns), plan.rig_names, plan.viewers)
    both = [key for key in pids if key in after and key in before]
    own_s = sum(after[key].processor_s - before[key].processor_s for key in both)
    p50, p99 = (of.latency_ms.get(key, float("nan")) for key in ("p50", "p99"))
    cores = 1e9 * own_s / (end_ns - start_ns)
    return Phase(p50, p99, of.loss, cores, machine_use(before, after, all_before, all_after))


def set_priority(pid: int, niceness: int, session_niceness: int) -> None:
    """Set the nice value of all threads of a process, and of its session where the kernel has one."""
    for thread in os.listdir(f"/proc/{pid}/task"):
        os.setpriority(os.PRIO_PROCESS, int(thread), niceness)
    session = Path(f"/proc/{pid}/autogroup")
    if session.is_file():
        session.write_text(str(session_niceness))


def _row(name: str, phases: list[Phase]) -> Row:
    return (
        name, median(one.p50 for one in phases), median(one.p99 for one in phases),
        ", ".join(f"{one.p99:.0f}" for one in phases), 100 * mean(one.loss for one in phases),
        f"{mean(one.readers for one in phases):.2f}", f"{mean(one.used.others for one in phases):.2f}",
    )  # fmt: skip


def _quiet(*_: object) -> None:
    """No progress."""
