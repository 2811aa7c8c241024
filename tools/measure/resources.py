"""Resources used by the processes of a load and by the machine, and the bottleneck among them."""

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import psutil

from zenocap.common.messages import Health
from zenocap.common.observe.losses import OF_LOAD
from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.unit_costs import LOOP_USABLE

SHARED_MEMORY = Path("/dev/shm")
ProcessKey = tuple[str, str, str]  # rig, service, id; rig "" for the router and the measuring process
ITSELF: ProcessKey = ("", "measuring", "main")
MACHINE_LIMIT = 0.95  # share of all cores; chosen by hand


def title(key: ProcessKey) -> str:
    """Name of a process for people: load-1 viewer 2, router."""
    return " ".join(word for word in key if word and word != "main")


@dataclass(frozen=True)
class ProcessSample:
    """Resources of one process.  processor_s: since its start.  memory_bytes: resident, without shared memory (films).

    handles: open files and sockets; 0 where the system does not count them.
    """

    pid: int
    at_s: float
    processor_s: float
    memory_bytes: int
    handles: int
    threads: int


@dataclass(frozen=True)
class Machine:
    """processor_s: processor time used since the machine's start on all cores, out of all_s."""

    processor_s: float
    all_s: float


def sample(pids: Mapping[ProcessKey, int]) -> dict[ProcessKey, ProcessSample]:
    """Samples of the processes that exist."""
    found = {}
    for key, pid in pids.items():
        try:
            found[key] = _sample(psutil.Process(pid))
        except (psutil.NoSuchProcess, psutil.AccessDenied, psutil.ZombieProcess):
            continue
    return found


def _sample(process: psutil.Process) -> ProcessSample:
    with process.oneshot():
        times, memory = process.cpu_times(), process.memory_info()
        handles = process.num_fds() if hasattr(process, "num_fds") else 0
        return ProcessSample(
            process.pid, time.monotonic(), times.user + times.system, memory.rss - getattr(memory, "shared", 0), handles,
            process.num_threads(),
        )  # fmt: skip


def machine() -> Machine:
    times = psutil.cpu_times()
    everything = sum(times) - getattr(times, "guest", 0.0) - getattr(times, "guest_nice", 0.0)  # those are in user
    return Machine(everything - times.idle - getattr(times, "iowait", 0.0), everything)


def cores() -> int:
    return psutil.cpu_count() or 1


def stored(folder: Path, pattern: str) -> tuple[int, int]:
    """Bytes and number of files in a folder; 0 and 0 where it does not exist."""
    sizes = []
    for path in folder.glob(pattern):
        with suppress(OSError):  # removed meanwhile
            sizes.append(path.stat().st_size)
    return sum(sizes), len(sizes)


@dataclass(frozen=True)
class Cost:
    """Resources of one service over the measured time.  cores: processor time per second.  busy: share of its loop's time.

    memory_bytes: at the end.  stages_ms: median times of its processing stages.  rate: events of the most frequent kind per
    second.  lost: dropped events by kind.  handles, threads: 0 for a service on another machine.
    """

    key: ProcessKey
    cores: float
    memory_bytes: int
    handles: int = 0
    threads: int = 0
    busy: float = 0.0
    rate: float = 0.0
    stages_ms: Mapping[str, float] = field(default_factory=dict)
    lost: Mapping[str, int] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return title(self.key)


@dataclass(frozen=True)
class MachineUse:
    """Use of the machine in cores: number of cores, used by the load, used by other processes."""

    cores: int
    own: float
    others: float


def costs(
    before: Mapping[ProcessKey, ProcessSample],
    after: Mapping[ProcessKey, ProcessSample],
    healths: Mapping[ProcessKey, Sequence[Health]],
) -> tuple[Cost, ...]:
    """Costs of all services.  before, after: of the processes on this machine.  healths: reports of all services."""
    found = []
    for key in sorted({*after, *healths}):
        reports, end, start = healths.get(key, ()), after.get(key), before.get(key)
        if end is None and not reports:
            continue
        cores = sum(health.cores for health in reports) / len(reports) if reports else 0.0
        if end is not None and start is not None and start.pid == end.pid and end.at_s > start.at_s:
            cores = (end.processor_s - start.processor_s) / (end.at_s - start.at_s)
        cost = Cost(key, cores, reports[-1].memory_bytes if reports else 0)
        if end is not None:
            cost = replace(cost, memory_bytes=end.memory_bytes, handles=end.handles, threads=end.threads)
        found.append(_with_health(cost, reports) if reports else cost)
    return tuple(found)


def _with_health(cost: Cost, reports: Sequence[Health]) -> Cost:
    first, last = reports[0].counts, reports[-1].counts
    lost = {name: last.get(name, 0) - first.get(name, 0) for name in OF_LOAD}
    busy, rate = (sum(values) / len(reports) for values in ([one.busy for one in reports], [one.rate for one in reports]))
    lost = {name: count for name, count in lost.items() if count > 0}
    return replace(cost, busy=busy, rate=rate, stages_ms=dict(reports[-1].stages_ms), lost=lost)


def bottleneck(plan: Plan, figures: Figures, every: Sequence[Cost], used: MachineUse) -> str:
    """The service or stage that limits the load, or is closest to its limit, in one sentence."""
    services = [cost for cost in every if cost.key != ITSELF and cost.key[1] != "router"]
    busiest = max(services, key=lambda cost: max(cost.busy, cost.cores), default=None)
    measuring = next((cost for cost in every if cost.key == ITSELF), None)
    if used.own + used.others >= MACHINE_LIMIT * used.cores:
        most = "other processes" if used.others > used.own else _costliest(every)
        return f"the processor: {_machine(used)}; most of it {most}"
    if busiest is not None and max(busiest.busy, busiest.cores) >= LOOP_USABLE:
        return f"{busiest.title}: {_busy(busiest)}"
    if measuring is not None and measuring.cores >= LOOP_USABLE:
        return f"the measuring process, which uses {measuring.cores:.2f} cores: measure a smaller load"
    held = figures.held(plan.period_s)
    losing = max(services, key=lambda cost: sum(cost.lost.values()), default=None)
    if not held and losing is not None and losing.lost:
        lost = ", ".join(f"{name.removeprefix('dropped_')} {count}" for name, count in losing.lost.items())
        return f"{losing.title}, which dropped ({lost}) although its loop is busy {losing.busy:.0%} only: it was delayed"
    if busiest is None:
        return "unknown: no service reported"
    if held:
        return f"none yet; closest to its limit is {busiest.title}: {_busy(busiest)}; {_machine(used)}"
    waits = "waiting for a core, or for the network"
    return f"no service alone: {waits}; the busiest is {busiest.title}: {_busy(busiest)}; {_machine(used)}"


def _busy(cost: Cost) -> str:
    return f"its loop is busy {cost.busy:.0%} of the time, {cost.cores:.2f} cores{_longest_stage('; ', cost.stages_ms)}"


def _longest_stage(separator: str, stages_ms: Mapping[str, float]) -> str:
    """The longest stage of a step, in words; empty without any."""
    name = max((name for name in stages_ms if name.startswith("step_")), key=lambda name: stages_ms[name], default=None)
    return f"{separator}longest stage {name} {stages_ms[name]:.1f} ms" if name else ""


def _machine(used: MachineUse) -> str:
    return f"{used.own + used.others:.1f} of {used.cores} cores used ({used.own:.1f} by the load)"


def _costliest(every: Sequence[Cost]) -> str:
    kinds = {cost.key[1]: sum(other.cores for other in every if other.key[1] == cost.key[1]) for cost in every}
    if not kinds:
        return "by other processes"
    kind = max(kinds, key=lambda name: kinds[name])
    stages: dict[str, float] = {}
    for cost in every:
        if cost.key[1] == kind:
            stages |= cost.stages_ms
    return f"{kind} ({kinds[kind]:.2f} cores together{_longest_stage(', ', stages)})"
