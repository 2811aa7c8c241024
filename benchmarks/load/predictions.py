"""Cores of loads as `zenocap plan` predicts them, beside the measured ones.

Predicted with the costs that are shipped, and with those of this machine as `--measure` finds them.
"""

from collections import defaultdict
from dataclasses import replace

from benchmarks.sections import Row, Section, Table

from benchmarks.load.bench import Bench
from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.plan.calculator import demand
from zenocap.tools.plan.costs import Costs
from zenocap.tools.plan.measure import installation_of, measured
from zenocap.tools.plan.parameters import COSTS

SMALL, LARGE = (160, 120), (640, 480)
LOADS = (
    Plan(),
    Plan(rate=60.0),
    Plan(size=LARGE),
    *(Plan(viewers=views, method="hybrid") for views in (2, 4, 7)),
    *(Plan(viewers=views, method="hybrid", size=LARGE, rate=rate) for views, rate in ((4, 30.0), (7, 10.0))),
    Plan(rigs=4, rate=15.0),
)
COLUMNS = (
    "load", "whole/s", "viewers: measured; plan; plan of this machine", "integrators", "tracker", "router",
    "all", "deviation of the plan, %", "deviation of this machine's, %", "others' cores",
)  # fmt: skip


def predictions(bench: Bench) -> Section:
    """Each load, compared at the rate that came out.  The costs of this machine are measured first, for each size."""
    own = {size: measured(COSTS, size, bench.session.measure) for size in (SMALL, LARGE)}
    rows = []
    for plan in LOADS:
        for _, point in bench.points([plan]):
            if point is not None:
                rows.append(row(point, own[plan.size]))
                print(rows[-1], flush=True)  # a run takes long, and may be ended
    notes = (
        "Cores of all processes of a kind.  The costs of this machine are those of `zenocap plan --measure` of the same "
        "size.  The measuring process is not compared.",
    )
    return Section("predictions", "The plan", notes, (Table("Predicted and measured cores", COLUMNS, tuple(rows)),))


def row(point: Measurement, own: Costs) -> Row:
    used = by_service(point)
    planned = [planned_cores(point, costs) for costs in (COSTS, own)]
    cells = [
        "; ".join(f"{cores.get(name, 0.0):.2f}" for cores in (used, *planned))
        for name in ("viewer", "integrator", "tracker", "router")
    ]
    whole = sum(used.get(name, 0.0) for name in planned[0])
    totals = [sum(cores.values()) for cores in planned]
    deviations = (100 * (total / whole - 1) for total in totals)
    return (
        point.plan.title(), point.figures.completed / point.seconds, *cells,
        "; ".join(f"{value:.2f}" for value in (whole, *totals)), *(f"{value:+.0f}" for value in deviations),
        f"{point.used.others:.2f}",
    )  # fmt: skip


def by_service(point: Measurement) -> dict[str, float]:
    """Cores of all processes of each service, as measured."""
    used: defaultdict[str, float] = defaultdict(float)
    for cost in point.costs:
        used[cost.key[1]] += cost.cores
    return dict(used)


def planned_cores(point: Measurement, costs: Costs) -> dict[str, float]:
    """The same by the plan, at the rate that came out."""
    rate = max(1.0, point.figures.completed / point.seconds / point.plan.rigs)
    services = demand(replace(installation_of(point.plan), fps=rate), costs).services
    return {one.service: one.number * one.cores for one in services}
