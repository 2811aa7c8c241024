"""Plots of the results: latency, loss and cost over the ramp's quantity; a soak over time."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from zenocap.tools.measure.latency import EDGES_MS
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.resources import title
from zenocap.tools.measure.soak import Soak

DPI = 120


def draw_points(path: Path, points: Sequence[Measurement], label: str, value: Callable[[Plan], float]) -> None:
    """Latency against its limit, loss, cores by kind of service, and the histogram of each point.  Raises OSError."""
    ordered = sorted(points, key=lambda point: value(point.plan))
    x = [value(point.plan) for point in ordered]
    figure, axes = _figure()
    for name, style in (("p50", "o-"), ("p95", "s-"), ("p99", "^-"), ("p99.9", "v:")):
        axes[0].plot(x, [point.figures.latency_ms.get(name, np.nan) for point in ordered], style, label=name)
    axes[0].plot(x, [1e3 * point.plan.period_s for point in ordered], "k_--", label="frame period", linewidth=0.8)
    axes[0].set(title="latency from the due time of a frame to its pose", xlabel=label, ylabel="ms", yscale="log")
    axes[1].plot(x, [point.figures.offered_fps for point in ordered], "k_--", label="offered", linewidth=0.8)
    axes[1].plot(x, [point.figures.completed_fps for point in ordered], "o-", label="completed")
    axes[1].set(title="frames of all viewers", xlabel=label, ylabel="frames/s", ylim=(0, None))
    for kind in sorted({cost.key[1] for point in ordered for cost in point.costs}):
        together = [sum(cost.cores for cost in point.costs if cost.key[1] == kind) for point in ordered]
        axes[2].plot(x, together, "o-", label=kind)
    axes[2].plot(x, [point.used.own + point.used.others for point in ordered], "k_--", linewidth=0.8, label="everybody")
    axes[2].axhline(ordered[0].used.cores, color="grey", linewidth=0.8, label="cores of the machine")
    axes[2].set(title="cores used", xlabel=label, ylim=(0, None))
    for point, at in zip(ordered, x, strict=True):
        counts = np.array(point.figures.histogram, dtype=float)
        axes[3].stairs(counts[1:-1] / max(1.0, counts.sum()), EDGES_MS, label=f"{at:g}")
    axes[3].set(title="latencies", xlabel="ms", ylabel="share of the frame sets", xscale="log")
    axes[3].legend(title=label, fontsize=7)
    for other in axes[:3]:
        other.legend(fontsize=7)
    figure.savefig(path, dpi=DPI)


def draw_soak(path: Path, soak: Soak) -> None:
    """Memory, handles and threads, latency and loss over time.  Raises OSError."""
    minutes = [bucket.at_s / 60 for bucket in soak.buckets]
    figure, axes = _figure()
    for key in sorted({key for bucket in soak.buckets for key in bucket.samples}):
        here = [bucket for bucket in soak.buckets if key in bucket.samples]
        times, samples = [bucket.at_s / 60 for bucket in here], [bucket.samples[key] for bucket in here]
        axes[0].plot(times, [one.memory_bytes / 1e6 for one in samples], label=title(key), linewidth=1)
        axes[1].plot(times, [one.handles for one in samples], label=title(key), linewidth=1)
        axes[1].plot(times, [one.threads for one in samples], ":", linewidth=1)
    axes[0].set(title="memory", ylabel="MB")
    axes[1].set(title="open files, and threads (dotted)")
    for name in ("p50", "p99", "max"):
        axes[2].plot(minutes, [bucket.figures.latency_ms.get(name, np.nan) for bucket in soak.buckets], label=name)
    axes[2].set(title="latency from the due time of a frame to its pose", ylabel="ms", yscale="log")
    axes[3].plot(minutes, [100 * bucket.figures.loss for bucket in soak.buckets], label="incomplete frame sets, %")
    axes[3].plot(minutes, [bucket.shared[0] / 1e6 for bucket in soak.buckets], label="shared memory, MB")
    axes[3].set(title=f"{len(soak.restarts)} restarts of a viewer (grey)", ylim=(0, None))
    for restart in soak.restarts:
        axes[3].axvline(restart.at_s / 60, color="grey", linewidth=0.4)
    for other in axes:
        other.set_xlabel("minutes")
        other.legend(fontsize=6)
    axes[0].set_ylim(0, None)
    axes[1].set_ylim(0, None)
    figure.savefig(path, dpi=DPI)


def _figure() -> tuple[Figure, list[Axes]]:
    """A figure with four plots."""
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    return figure, [figure.add_subplot(2, 2, number) for number in range(1, 5)]
