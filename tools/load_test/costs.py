"""Resources used by each service of a load, and the bottleneck among them.  Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from zenocap.common.messages import Health
from zenocap.common.observe.losses import OF_LOAD
from zenocap.tools.load_test.latency import Figures
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.load_test.processes import ITSELF, ProcessKey, Sample

MACHINE_LIMIT, SERVICE_LIMIT = (
    0.95,
    0.85,
)  # shares, chosen by hand: of all cores; of a loop's time or its core


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
        return " ".join(word for word in self.key if word and word != "main")


@dataclass(frozen=True)
class MachineUse:
    """Use of the machine in cores: number of cores, used by the load, used by other processes."""

    cores: int
    own: float
    others: float


def costs(
    before: Mapping[ProcessKey, Sample], after: Mapping[ProcessKey, Sample], healths: Mapping[ProcessKey, Sequence[Health]]
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
        cost = Cost(key, cores, end.memory_bytes if end else reports[-1].memory_bytes)
        found.append(_with_health(_with_process(cost, end), reports))
    return tuple(found)


def _with_process(cost: Cost, end: Sample | None) -> Cost:
    if end is None:
        return cost
    return Cost(cost.key, cost.cores, cost.memory_bytes, end.handles, end.threads)


def _with_health(cost: Cost, reports: Sequence[Health]) -> Cost:
    if not reports:
        return cost
    first, last = reports[0].counts, reports[-1].counts
    lost = {name: last.get(name, 0) - first.get(name, 0) for name in OF_LOAD}
    return Cost(
        cost.key, cost.cores, cost.memory_bytes, cost.handles, cost.threads,
        busy=sum(health.busy for health in reports) / len(reports),
        rate=sum(health.rate for health in reports) / len(reports),
        stages_ms=dict(reports[-1].stages_ms),
        lost={name: count for name, count in lost.items() if count > 0},
    )  # fmt: skip


def bottleneck(plan: Plan, figures: Figures, every: Sequence[Cost], used: MachineUse) -> str:
    """The service or stage that limits the load, or is closest to its limit, in one sentence."""
    services = [cost for cost in every if cost.key != ITSELF and cost.key[1] != "router"]
    busiest = max(services, key=lambda cost: max(cost.busy, cost.cores), default=None)
    measuring = next((cost for cost in every if cost.key == ITSELF), None)
    if used.own + used.others >= MACHINE_LIMIT * used.cores:
        most = "other processes" if used.others > used.own else _costliest(every)
        return f"the processor: {_machine(used)}; most of it {most}"
    if busiest is not None and max(busiest.busy, busiest.cores) >= SERVICE_LIMIT:
        return f"{busiest.title}: {_busy(busiest)}"
    if measuring is not None and measuring.cores >= SERVICE_LIMIT:
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
    stages = {name: ms for name, ms in cost.stages_ms.items() if name.startswith("step_")}
    text = f"its loop is busy {cost.busy:.0%} of the time, {cost.cores:.2f} cores"
    if not stages:
        return text
    longest = max(stages, key=lambda name: stages[name])
    return f"{text}; longest stage {longest} {stages[longest]:.1f} ms"


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
            stages |= {name: ms for name, ms in cost.stages_ms.items() if name.startswith("step_")}
    longest = max(stages, key=lambda name: stages[name], default=None)
    detail = f", longest stage {longest} {stages[longest]:.1f} ms" if longest else ""
    return f"{kind} ({kinds[kind]:.2f} cores together{detail})"
