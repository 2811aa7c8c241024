"""Measurement of plans, and their tables."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.sections import Cell, Row, Table
from rich.console import Console

from zenocap.common.bus.protocol import BusError
from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import LoadError, Plan
from zenocap.tools.load_test.plot import draw_points
from zenocap.tools.load_test.report import report
from zenocap.tools.load_test.shell import Network, Session, prepared


@dataclass
class Bench:
    """Measurements.  seconds: measuring time per plan.  out: folder of the figures.  points: all measured so far."""

    session: Session
    seconds: float
    out: Path
    stopped: Callable[[], bool]

    def points(self, plans: Sequence[Plan]) -> list[tuple[Plan, Measurement | None]]:
        """Measure each plan; None where no pose arrived."""
        found: list[tuple[Plan, Measurement | None]] = []
        for plan in plans:
            if self.stopped():
                break
            found.append((plan, self.point(plan)))
        return found

    def point(self, plan: Plan) -> Measurement | None:
        try:
            return self.session.measure(replace(plan, seconds=self.seconds))
        except (LoadError, BusError) as error:
            print(f"{plan.title()}: {error}", flush=True)
            return None

    def keep(self, name: str, points: Sequence[Measurement], label: str, value: Callable[[Plan], float]) -> str:
        """Write all measurements as JSON and a plot; return the plot's name."""
        self.out.mkdir(parents=True, exist_ok=True)
        (self.out / f"{name}-points.json").write_bytes(report(points))
        draw_points(self.out / f"{name}.png", points, label, value)
        return f"{name}.png"


@contextmanager
def bench(seconds: float, out: Path, stopped: Callable[[], bool]) -> Iterator[Bench]:
    """A Bench with compiled kernels, temporary films, and a router per measurement."""
    with prepared(Plan(viewers=4, method="hybrid"), Network(), stopped, Console(stderr=True)) as session:
        yield Bench(session, seconds, out, stopped)


COLUMNS = (
    "what", "offered frames/s", "completed", "lost %", "p50 ms", "p95", "p99", "p99.9", "skew p99 ms", "cores",
    "others' cores", "MB", "held",
)  # fmt: skip


def table(title: str, points: Sequence[tuple[Plan, Measurement | None]]) -> Table:
    return Table(title, COLUMNS, tuple(_row(plan, point) for plan, point in points))


def limits(points: Sequence[tuple[Plan, Measurement | None]]) -> Table:
    """The bottleneck of each plan."""
    rows = tuple((plan.title(), point.bottleneck if point else "no pose") for plan, point in points)
    return Table("Current or next bottleneck", ("what", "limit"), rows)


def _row(plan: Plan, point: Measurement | None) -> Row:
    if point is None:
        return (plan.title(), plan.rate * plan.viewers * plan.rigs, *[float("nan")] * 10, "no")
    found = point.figures
    latency: list[Cell] = [found.latency_ms.get(name, float("nan")) for name in ("p50", "p95", "p99", "p99.9")]
    return (
        plan.title(), found.offered_fps, found.completed_fps, 100 * found.loss, *latency,
        found.skew_ms.get("p99", float("nan")), f"{point.used.own:.2f}", f"{point.used.others:.2f}",
        sum(cost.memory_bytes for cost in point.costs) / 1e6, "yes" if point.held else "no",
    )  # fmt: skip
