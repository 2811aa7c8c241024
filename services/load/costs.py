"""What each service of a load cost, and which one of them is the limit.  Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from common.messages import Health
from services.load.heard import Figures
from services.load.plan import Plan
from services.load.processes import ITSELF, Sample, Who

FULL, NEARLY = 0.95, 0.85  # of a machine's cores; of one loop's time, or of the one core that a Python process can use
LOSSES = ("dropped_frames", "dropped_superseded", "dropped_queue_full", "dropped_instants", "step_errors", "log_lost")


@dataclass(frozen=True)
class Cost:
    """Of one service over the measured seconds.  cores: processor time per second.  busy: share of its loop's time.

    memory_bytes: at the end.  stages_ms: medians of what it does for an event.  rate: events of the busiest kind per
    second.  lost: what it dropped meanwhile, by kind.  handles, threads: 0 for one that runs elsewhere.
    """

    who: Who
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
        return " ".join(word for word in self.who if word and word != "main")


@dataclass(frozen=True)
class Used:
    """Of the machine, in cores: there are so many; used by the load; used by others meanwhile."""

    cores: int
    own: float
    others: float


def costs(
    before: Mapping[Who, Sample], after: Mapping[Who, Sample], healths: Mapping[Who, Sequence[Health]]
) -> tuple[Cost, ...]:
    """before, after: of the processes here.  healths: what each service said meanwhile, those elsewhere too."""
    found = []
    for who in sorted({*after, *healths}):
        said, end, start = healths.get(who, ()), after.get(who), before.get(who)
        if end is None and not said:
            continue
        cores = sum(health.cores for health in said) / len(said) if said else 0.0
        if end is not None and start is not None and start.pid == end.pid and end.at_s > start.at_s:
            cores = (end.processor_s - start.processor_s) / (end.at_s - start.at_s)
        cost = Cost(who, cores, end.memory_bytes if end else said[-1].memory_bytes)
        found.append(_with_health(_with_process(cost, end), said))
    return tuple(found)


def _with_process(cost: Cost, end: Sample | None) -> Cost:
    if end is None:
        return cost
    return Cost(cost.who, cost.cores, cost.memory_bytes, end.handles, end.threads)


def _with_health(cost: Cost, said: Sequence[Health]) -> Cost:
    if not said:
        return cost
    first, last = said[0].counts, said[-1].counts
    lost = {name: last.get(name, 0) - first.get(name, 0) for name in LOSSES}
    return Cost(
        cost.who, cost.cores, cost.memory_bytes, cost.handles, cost.threads,
        busy=sum(health.busy for health in said) / len(said),
        rate=sum(health.rate for health in said) / len(said),
        stages_ms=dict(said[-1].stages_ms),
        lost={name: count for name, count in lost.items() if count > 0},
    )  # fmt: skip


def bottleneck(plan: Plan, figures: Figures, every: Sequence[Cost], used: Used) -> str:
    """Which service or stage is the limit, or is the next one to be, in one sentence."""
    services = [cost for cost in every if cost.who != ITSELF and cost.who[1] != "router"]
    busiest = max(services, key=lambda cost: max(cost.busy, cost.cores), default=None)
    itself = next((cost for cost in every if cost.who == ITSELF), None)
    if used.own + used.others >= FULL * used.cores:
        most = "others, which are no part of the load" if used.others > used.own else _most(every)
        return f"the processor: {_machine(used)}; most of it {most}"
    if busiest is not None and max(busiest.busy, busiest.cores) >= NEARLY:
        return f"{busiest.title}: {_busy(busiest)}"
    if itself is not None and itself.cores >= NEARLY:
        return f"the measuring itself, which uses {itself.cores:.2f} cores: start less of it in one place"
    held = figures.held(plan.period_s)
    losing = max(services, key=lambda cost: sum(cost.lost.values()), default=None)
    if not held and losing is not None and losing.lost:
        lost = ", ".join(f"{name.removeprefix('dropped_')} {count}" for name, count in losing.lost.items())
        return f"{losing.title}, which dropped ({lost}) although its loop is busy {losing.busy:.0%} only: it was held up"
    if busiest is None:
        return "unknown: no service was heard"
    if held:
        return f"nothing yet; nearest to its limit is {busiest.title}: {_busy(busiest)}; {_machine(used)}"
    waits = "waiting for a core, or for the network"
    return f"no service alone: {waits}; the busiest is {busiest.title}: {_busy(busiest)}; {_machine(used)}"


def _busy(cost: Cost) -> str:
    stages = {name: ms for name, ms in cost.stages_ms.items() if name.startswith("step_")}
    words = f"its loop is busy {cost.busy:.0%} of the time, {cost.cores:.2f} cores"
    if not stages:
        return words
    longest = max(stages, key=lambda name: stages[name])
    return f"{words}; longest stage {longest} {stages[longest]:.1f} ms"


def _machine(used: Used) -> str:
    return f"{used.own + used.others:.1f} of {used.cores} cores used ({used.own:.1f} by the load)"


def _most(every: Sequence[Cost]) -> str:
    kinds = {cost.who[1]: sum(other.cores for other in every if other.who[1] == cost.who[1]) for cost in every}
    if not kinds:
        return "by others"
    kind = max(kinds, key=lambda name: kinds[name])
    stages: dict[str, float] = {}
    for cost in every:
        if cost.who[1] == kind:
            stages |= {name: ms for name, ms in cost.stages_ms.items() if name.startswith("step_")}
    longest = max(stages, key=lambda name: stages[name], default=None)
    detail = f", longest stage {longest} {stages[longest]:.1f} ms" if longest else ""
    return f"{kind} ({kinds[kind]:.2f} cores together{detail})"
