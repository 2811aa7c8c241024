"""Overload curves: instants offered, whole ones that came out, and their latency; cores as the plan predicts them."""

from collections.abc import Sequence
from dataclasses import replace

from benchmarks.sections import Row, Section, Table, markdown

from benchmarks.load.bench import Bench
from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.plan.calculator import demand
from zenocap.tools.plan.measure import installation_of
from zenocap.tools.plan.parameters import COSTS

SETTLE_S = 15.0  # until the integrator has found the rate; chosen by hand
LARGE = (640, 480)
CURVES: tuple[tuple[str, Plan, tuple[float, ...]], ...] = (
    ("two-view, 640x480", Plan(size=LARGE), (15.0, 30.0, 60.0, 120.0)),
    ("two-view, 160x120", Plan(), (60.0, 120.0, 240.0, 480.0)),
    ("tracker, 4 views, 160x120", Plan(viewers=4, method="hybrid"), (15.0, 30.0, 60.0, 120.0)),
    ("tracker, 4 views, 640x480", Plan(viewers=4, method="hybrid", size=LARGE), (30.0, 60.0)),
    ("silhouettes of 32 viewers, 160x120", Plan(viewers=32, method="hybrid", until="silhouette"), (30.0, 60.0)),
)
COLUMNS = (
    "offered instants/s", "whole instants/s", "of the most, %", "partial %", "p50 ms", "p99 ms", "p99, periods", "cores",
    "cores by the plan", "others' cores",
)  # fmt: skip
NOTES = (
    "All processes are on one machine. Whole: with all views. Most: the largest number of whole instants per second at any "
    "offered rate. Periods: of the whole instants that came out. Others' cores: of programs that are no part of the load.",
)


def overload(bench: Bench) -> Section:
    """Whole instants and latency over the offered rate, for each method."""
    tables = []
    for title, plan, rates in CURVES:
        found = bench.points([replace(plan, rate=rate, settle_s=SETTLE_S) for rate in rates])
        tables.append(Table(title, COLUMNS, curve([point for _, point in found if point is not None])))
        print(markdown(tables[-1]), flush=True)  # a run takes long, and may be ended
    return Section("overload", "Overload", NOTES, tuple(tables))


def curve(points: Sequence[Measurement]) -> tuple[Row, ...]:
    """A row for each offered rate."""
    most = max((_whole(point) for point in points), default=0.0)
    return tuple(_row(point, most) for point in points)


def _whole(point: Measurement) -> float:
    return point.figures.completed / point.seconds if point.seconds > 0 else 0.0


def _row(point: Measurement, most: float) -> Row:
    whole, figures = _whole(point), point.figures
    arrived = figures.completed + figures.partial
    p50, p99 = (figures.latency_ms.get(name, float("nan")) for name in ("p50", "p99"))
    planned = demand(installation_of(replace(point.plan, rate=max(1.0, whole))), COSTS).cores
    return (
        point.plan.rate, whole, 100 * whole / most if most else 0.0, 100 * figures.partial / max(1, arrived), p50, p99,
        p99 * whole / 1e3, f"{point.used.own:.2f}", f"{planned:.2f}", f"{point.used.others:.2f}",
    )  # fmt: skip
