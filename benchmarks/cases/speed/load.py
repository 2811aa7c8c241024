"""Whole rigs under load, as `zenocap load` measures them, and the cores that `zenocap plan` predicts."""

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import cast

from rich.console import Console

from benchmarks.cases.speed.busy import busy_processes
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.harness.results import HOLDS
from benchmarks.people.films import size_of
from zenocap.common.runtime.signals import stop_signals
from zenocap.tools.measure.installation import demand
from zenocap.tools.measure.installation_plan import installation_of
from zenocap.tools.measure.load_plan import MAX_RATE, Plan
from zenocap.tools.measure.load_processes import LoadNetwork
from zenocap.tools.measure.load_session import prepared
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.ramp import RampQuantity, ramp
from zenocap.tools.measure.unit_costs import COSTS

OVERLOAD = 2.0  # of the capacity
OVERLOAD_SETTLE_S, OVERLOAD_S = 15.0, 60.0  # until the integrator has found the rate, and measured; chosen by hand
LEAST_WHOLE, MOST_PERIODS = 80.0, 3.0  # limits there: whole sets, % of the capacity; p99, frame periods of the offer
OF_MEASURING = ("busy", "more", "overload")  # options: see `run` and `run_capacity`


def plan_of(one: Case) -> Plan:
    """Options: the fields of `Plan`, the size as WIDTHxHEIGHT, beside those of OF_MEASURING."""
    given = {name: value for name, value in one.options if name not in OF_MEASURING}
    return replace(Plan(), **given | {"size": size_of(one.option("size", "160x120"))})  # type: ignore[arg-type]


def run(one: Case) -> Figures:
    """One load.  Options: as of `plan_of`; busy, processes that never wait."""
    plan = plan_of(one)
    with (
        stop_signals() as stopped,
        busy_processes(one.option("busy", 0)),
        prepared(plan, LoadNetwork(), stopped, Console(stderr=True)) as session,
    ):
        return figures(session.measure(plan))


def figures(point: Measurement) -> dict[str, float]:
    found, rate = point.figures, point.figures.completed / point.seconds / point.plan.rigs
    planned = demand(replace(installation_of(point.plan), fps=max(1.0, rate)), COSTS).cores
    latency = {name: found.latency_ms[name] for name in ("p50", "p99") if name in found.latency_ms}
    return {
        "offered": found.offered_fps,
        "completed": found.completed_fps,
        "whole": found.completed / point.seconds,
        "lost": 100 * found.loss,
        **latency,
        "cores": point.used.own,
        "cores by the plan": planned,
        "cores of others": point.used.others,
        "memory": sum(cost.memory_bytes for cost in point.costs) / 1e6,
    }


def run_capacity(one: Case) -> Figures:
    """The largest load that is held.  Options: as of `plan_of`; more: rate or rigs; overload: with `overload_figures`."""
    plan, what = plan_of(one), cast(RampQuantity, one.option("more", "rate"))
    with stop_signals() as stopped, prepared(plan, LoadNetwork(), stopped, Console(stderr=True)) as session:
        found = ramp(plan, what, session.measure, stopped, lambda point: None)
        held = max((getattr(point.plan, what) for point in found.points if point.held), default=0.0)
        return {"held": held, **(overload_figures(plan, held, session.measure) if one.option("overload", False) else {})}


def overload_figures(plan: Plan, held: float, measure: Callable[[Plan], Measurement]) -> Figures:
    """Figures where OVERLOAD times the capacity is offered: whole frame sets/s of an unlimited offer, at least `held`."""
    most = measure(replace(plan, rate=MAX_RATE, settle_s=OVERLOAD_SETTLE_S, seconds=OVERLOAD_S))
    capacity = max(held, most.figures.completed / most.seconds)
    point = measure(replace(most.plan, rate=OVERLOAD * capacity)) if capacity else most
    whole = 100 * point.figures.completed / point.seconds / (capacity or inf)
    periods = point.figures.latency_ms.get("p99", inf) / (1e3 * point.plan.period_s)
    return {"capacity": capacity, "whole": whole, "p99": periods, HOLDS: whole >= LEAST_WHOLE and periods <= MOST_PERIODS}


_HYBRID = {"method": "hybrid"}
LOAD = Kind(
    "load",
    "Rigs with all processes on one machine: frames offered and completed by all viewers, whole instants a second, "
    "latency of the poses, cores of the load, as `zenocap plan` predicts them, and of other programs.",
    run,
    (
        Quantity("offered", "frames/s", 0, "", "median"),
        Quantity("completed", "frames/s", 0, "low", "median"),
        Quantity("whole", "instants/s", 1, "low", "median"),
        Quantity("lost", "%", 1),
        Quantity("p50", "ms", 1, joined="median"),
        Quantity("p99", "ms", 1, joined="median"),
        Quantity("cores", "", 2, joined="median"),
        Quantity("cores by the plan", "", 2, "", "median"),
        Quantity("cores of others", "", 2, joined="median"),
        Quantity("memory", "MB", 0, joined="median"),
    ),
    {
        f"two viewers, {size}, {rate:g}/s": case("rates", size=size, rate=rate)
        for size in ("160x120", "640x480")
        for rate in (15.0, 30.0, 60.0, 120.0)
    }
    | {
        f"two viewers, {size}, without limit": case("unlimited", size=size, rate=MAX_RATE)
        for size in ("160x120", "640x480")
    }
    | {
        f"{count} viewers and tracker, 15/s": case("viewers", viewers=count, rate=15.0, **_HYBRID)
        for count in (2, 4, 7, 8, 16, 32)
    }
    | {
        f"{count} {'stand-ins' if stand_ins else 'viewers'}, silhouettes only, 30/s": case(
            "viewers", viewers=count, until="silhouette", stand_ins=stand_ins, **_HYBRID
        )
        for stand_ins in (False, True)
        for count in (2, 4, 8, 16, 32)
    }
    | {
        f"{count} rigs of {'stand-ins' if stand_ins else 'two viewers'}, 15/s": case(
            "rigs", rigs=count, rate=15.0, stand_ins=stand_ins
        )
        for stand_ins in (False, True)
        for count in (1, 4, 16)
    }
    | {
        f"{count} subscribers, {priority} priority": case(
            "subscribers", stand_ins=True, subscribers=count, subscriber_priority=priority
        )
        for priority in ("low", "normal")
        for count in (1, 4, 16)
    }
    | {
        f"{'mesh' if mesh else 'router'}, {'stand-ins' if stand_ins else 'viewers'}": case(
            "network", mesh=mesh, stand_ins=stand_ins
        )
        for stand_ins in (False, True)
        for mesh in (False, True)
    }
    | {"two viewers and tracker, 640x480, 30/s, beside 2 busy processes": case("busy", size="640x480", busy=2, **_HYBRID)},
    case("network", stand_ins=True, seconds=2.0),
    rows="load",
    timed=True,
)
CAPACITY = Kind(
    "capacity",
    "The largest load that is held without loss and with p99 within one frame period, found by a ramp; the capacity, whole "
    "frame sets a second without a limit of the offer; whole frame sets and p99 where twice the capacity is offered.",
    run_capacity,
    (
        Quantity("held", "", 1, "low", "median"),
        Quantity("capacity", "instants/s", 1, "low", "median"),
        Quantity("whole", f"% of that, at least {LEAST_WHOLE:g}", 0, "low", "median"),
        Quantity("p99", f"periods, at most {MOST_PERIODS:g}", 1, joined="median"),
        Quantity(HOLDS, worst="low"),
    ),
    {
        "frames/s of two viewers, 160x120": case("capacity", rate=30.0, overload=True),
        "frames/s of two viewers, 640x480": case("capacity", rate=15.0, size="640x480", overload=True),
        "frames/s of two stand-ins": case("capacity", rate=60.0, stand_ins=True),
        "frames/s of four viewers and tracker": case("capacity", viewers=4, rate=7.5, overload=True, **_HYBRID),
        "rigs of two viewers, 15/s": case("capacity", rate=15.0, more="rigs"),
        "rigs of two stand-ins, 15/s": case("capacity", rate=15.0, stand_ins=True, more="rigs"),
    },
    case("capacity", rate=400.0, stand_ins=True, seconds=1.0),
    rows="load",
    timed=True,
)
