"""Measuring plan after plan, and their tables."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from services.load.plan import LoadError, Plan
from services.load.plot import draw_points
from services.load.point import Point
from services.load.report import report
from services.load.shell import Network, Session, prepared
from tests.evaluation.sections import Cell, Row, Table


@dataclass
class Bench:
    """seconds: measured of each plan.  out: folder of the figures.  points: all so far."""

    session: Session
    seconds: float
    out: Path
    stopped: Callable[[], bool]

    def points(self, plans: Sequence[Plan]) -> list[tuple[Plan, Point | None]]:
        """Of each plan; None where it gave no pose at all."""
        found: list[tuple[Plan, Point | None]] = []
        for plan in plans:
            if self.stopped():
                break
            found.append((plan, self.point(plan)))
        return found

    def point(self, plan: Plan) -> Point | None:
        try:
            return self.session.measure(replace(plan, seconds=self.seconds))
        except LoadError as error:
            print(f"{plan.title()}: {error}", flush=True)
            return None

    def keep(self, name: str, points: Sequence[Point], label: str, value: Callable[[Plan], float]) -> str:
        """Everything that was measured as JSON, and a picture, whose name is returned."""
        self.out.mkdir(parents=True, exist_ok=True)
        (self.out / f"{name}-points.json").write_bytes(report(points))
        draw_points(self.out / f"{name}.png", points, label, value)
        return f"{name}.png"


@contextmanager
def bench(seconds: float, out: Path, stopped: Callable[[], bool]) -> Iterator[Bench]:
    """With everything compiled, films in a folder that is thrown away, and a router for each measurement."""
    with prepared(Plan(viewers=4, method="hybrid"), Network(), stopped, Console(stderr=True)) as session:
        yield Bench(session, seconds, out, stopped)


COLUMNS = (
    "what", "offered frames/s", "completed", "lost %", "p50 ms", "p95", "p99", "p99.9", "skew p99 ms", "cores",
    "others' cores", "MB", "held",
)  # fmt: skip


def table(title: str, points: Sequence[tuple[Plan, Point | None]]) -> Table:
    return Table(title, COLUMNS, tuple(_row(plan, point) for plan, point in points))


def limits(points: Sequence[tuple[Plan, Point | None]]) -> Table:
    """What each was limited by."""
    rows = tuple((plan.title(), point.bottleneck if point else "no pose came") for plan, point in points)
    return Table("What is, or is next, the limit", ("what", "limit"), rows)


def _row(plan: Plan, point: Point | None) -> Row:
    if point is None:
        return (plan.title(), plan.rate * plan.viewers * plan.rigs, *[float("nan")] * 10, "no")
    found = point.figures
    latency: list[Cell] = [found.latency_ms.get(name, float("nan")) for name in ("p50", "p95", "p99", "p99.9")]
    return (
        plan.title(), found.offered_fps, found.completed_fps, 100 * found.loss, *latency,
        found.skew_ms.get("p99", float("nan")), f"{point.used.own:.2f}", f"{point.used.others:.2f}",
        sum(cost.memory_bytes for cost in point.costs) / 1e6, "yes" if point.held else "no",
    )  # fmt: skip
