"""Results as tables and lines for the terminal."""

from collections.abc import Mapping, Sequence

from rich.table import Table
from rich.text import Text

from zenocap.tools.measure.latency import EDGES_MS
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.soak import Soak

BAR = 40  # characters of the largest bin
MAX_COSTS = 12  # rows; more are grouped by kind


def points_table(points: Sequence[Measurement]) -> Table:
    """Table with a row per measurement."""
    table = Table(title="load", title_justify="left")
    for heading in ("what", "offered", "completed", "lost", "p50", "p95", "p99", "p99.9 ms", "skew p99", "cores", "held"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    for point in points:
        found = point.figures
        table.add_row(
            point.plan.title(), f"{found.offered_fps:.0f}/s", f"{found.completed_fps:.0f}/s", f"{100 * found.loss:.2f} %",
            *(_ms(found.latency_ms, name) for name in ("p50", "p95", "p99", "p99.9")), _ms(found.skew_ms, "p99"),
            f"{point.used.own:.2f} + {point.used.others:.2f}",
            Text("yes", style="green") if point.held else Text("no", style="red"),
        )  # fmt: skip
    return table


def costs_table(point: Measurement) -> Table:
    """Table of resources by service, or by kind of service where there are many."""
    table = Table(title="resources by service", title_justify="left")
    for heading in ("service", "cores", "loop busy", "MB", "files", "threads", "dropped"):
        table.add_column(heading, justify="left" if heading in ("service", "dropped") else "right")
    if len(point.costs) <= MAX_COSTS:
        for cost in point.costs:
            dropped = ", ".join(f"{name.removeprefix('dropped_')} {count}" for name, count in cost.lost.items())
            numbers = (f"{cost.cores:.2f}", f"{cost.busy:.0%}", f"{cost.memory_bytes / 1e6:.0f}")
            table.add_row(cost.title, *numbers, str(cost.handles), str(cost.threads), dropped)
        return table
    for kind in sorted({cost.key[1] for cost in point.costs}):
        each = [cost for cost in point.costs if cost.key[1] == kind]
        dropped = str(sum(sum(cost.lost.values()) for cost in each) or "")
        table.add_row(
            f"{len(each)} x {kind}", f"{sum(cost.cores for cost in each):.2f}", f"to {max(cost.busy for cost in each):.0%}",
            f"{sum(cost.memory_bytes for cost in each) / 1e6:.0f}", str(sum(cost.handles for cost in each)),
            str(sum(cost.threads for cost in each)), dropped,
        )  # fmt: skip
    return table


def rate_line(point: Measurement) -> str:
    """Frame sets completed per second, and the cores of each viewer and of what computes the poses."""
    viewers = [f"{cost.cores:.2f}" for cost in point.costs if cost.key[1] == "viewer"]
    others = [f"{cost.title} {cost.cores:.2f}" for cost in point.costs if cost.key[1] in ("integrator", "tracker")]
    many = len(viewers) + len(others) > MAX_COSTS
    cores = "" if many else "; cores: " + ", ".join(["viewers " + " and ".join(viewers), *others])
    rate = point.figures.completed / point.seconds if point.seconds > 0 else 0.0
    return f"frame sets: {point.plan.rate * point.plan.rigs:g}/s offered, {rate:.1f}/s completed{cores}"


def histogram_lines(counts: Sequence[int]) -> list[str]:
    """Histogram of latencies as bars, from the first filled bin to the last."""
    filled = [k for k, count in enumerate(counts) if count]
    if not filled:
        return []
    most = max(counts)
    edges = (0.0, *EDGES_MS)
    return [
        f"{edges[k]:9.2f} ms  {'#' * round(BAR * counts[k] / most):<{BAR}}  {counts[k]}"
        for k in range(filled[0], filled[-1] + 1)
    ]


def soak_table(soak: Soak) -> Table:
    """Table of the trends."""
    table = Table(title=f"soak: {soak.plan.title()}", title_justify="left")
    for heading in ("what", "settled", "at the end", "flat"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    for trend in soak.trends:
        flat = Text("yes", style="green") if trend.flat else Text("no", style="red")
        table.add_row(trend.what, _amount(trend.first, trend.unit), _amount(trend.last, trend.unit), flat)
    return table


def soak_lines(soak: Soak) -> list[str]:
    offered = sum(bucket.figures.offered for bucket in soak.buckets)
    completed = sum(bucket.figures.completed for bucket in soak.buckets)
    back = sorted(restart.back_s for restart in soak.restarts if restart.back_s is not None)
    lines = [f"frame sets: {offered} offered, {completed} complete ({100 * completed / max(1, offered):.2f} %)"]
    if back:
        lines.append(
            f"restarts: {len(soak.restarts)}; complete again after {back[len(back) // 2]:.1f} s (worst {back[-1]:.1f} s)"
        )
    if soak.failure:
        lines.append(f"ended early: {soak.failure}")
    return [*lines, "everything is flat" if soak.flat else "NOT everything is flat, or the run was too short"]


def _ms(named: Mapping[str, float], name: str) -> str:
    return f"{named[name]:.1f}" if name in named else "-"


def _amount(value: float, unit: str) -> str:
    return f"{value / 1e6:.1f} MB" if unit == "bytes" else f"{value:.1f} {unit}".rstrip()
