"""Metric families of the observations.

Counters are those of the services since their start: a restart sets them to 0, which Prometheus' `rate` detects.  Gauges
of a service are left out while it is silent, so that no outdated value is shown.
"""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence

from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from zenocap.common.messages import Health
from zenocap.common.observe.losses import EXPORTED
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.service_info import versions
from zenocap.tools.operate.metrics import parameters
from zenocap.tools.operate.metrics.observations import Histogram, Observations

SERVICE = ("rig", "service", "id")

COUNTERS: Mapping[str, tuple[str, str]] = {  # count of a health message: name of the metric, its description
    "frames": ("zenocap_frames", "Frames of the service's own source that were processed."),
    "published": ("zenocap_messages_published", "Messages that were published."),
    "received": ("zenocap_messages_received", "Valid messages that were received."),
    "dropped_superseded": ("zenocap_messages_superseded", "Messages replaced by newer ones before use; normal."),
    "log_messages": ("zenocap_log_messages", "Messages written to the take."),
}
COUNT_GAUGES: Mapping[str, tuple[str, str, float]] = {  # the same with a factor to the base unit
    "queued": ("zenocap_queued_messages", "Received messages that wait to be processed.", 1.0),
    "kept_percent": ("zenocap_frame_share", "Share of the frames that the viewer processes; 1 without overload.", 0.01),
    "source_frames_per_1000_s": ("zenocap_source_rate_hertz", "True rate of a camera or stream.", 1e-3),
    "source_jitter_us": ("zenocap_source_jitter_seconds", "95 % of its intervals are this near the median one.", 1e-6),
    "source_returns": ("zenocap_source_returns", "How often a camera or stream was lost and came back.", 1.0),
    "log_on": ("zenocap_log_recording", "1 while a take is recorded, else 0.", 1.0),
    "log_stopped": ("zenocap_log_stopped", "1 when the take could not be written any more, else 0.", 1.0),
    "log_free_mb": ("zenocap_log_free_bytes", "Free space of the disk with the takes.", 1e6),
    "certificate_days": ("zenocap_certificate_left_seconds", "Until its certificate expires, whole days.", 86400.0),
}
HEALTH_GAUGES: tuple[tuple[str, str, Callable[[Health], float]], ...] = (
    ("zenocap_rate_hertz", "Frames per second, or messages of the busiest topic.", lambda health: health.rate),
    ("zenocap_memory_bytes", "Resident memory of the process.", lambda health: health.memory_bytes),
    ("zenocap_cores", "Processor time used per second, in cores.", lambda health: health.cores),
    ("zenocap_busy_ratio", "Share of its time that the service's loop works.", lambda health: health.busy),
)


class RigCollector(Collector):
    """The families of all rigs; `collect` is called by the threads of the HTTP server.

    lock: held while the observations are read, and by the thread that writes them.
    """

    def __init__(self, observations: Observations, lock: threading.Lock, clock: Clock) -> None:
        self._observations, self._lock, self._clock = observations, lock, clock
        self._versions = versions()

    def describe(self) -> list[Metric]:
        return []  # nothing to check at registration: the names are in this file

    def collect(self) -> Iterator[Metric]:
        with self._lock:
            families = [*self._exporter(), *self._services(), *self._clocks(), *self._poses()]
        return iter(families)

    def _exporter(self) -> Iterator[Metric]:
        build = GaugeMetricFamily("zenocap_build_info", "Versions; the value is 1.", labels=("version", "python", "zenoh"))
        build.add_metric([self._versions[name] for name in ("zenocap", "python", "eclipse-zenoh")], 1)
        yield build
        ignored = CounterMetricFamily(
            "zenocap_metrics_ignored", "Rigs and messages of unknown services that are not exported.", labels=("what",)
        )
        ignored.add_metric(["rig"], self._observations.ignored)
        ignored.add_metric(["service"], sum(rig.ignored for rig in self._observations.rigs.values()))
        yield ignored

    def _services(self) -> Iterator[Metric]:
        up = GaugeMetricFamily("zenocap_up", "1 while the service publishes its health, else 0.", labels=SERVICE)
        gauges, counters = _Gauges(), _Counters()
        for rig in self._observations.rigs.values():
            states = rig.services()
            for row in rig.rows(self._clock.elapsed_ns()):
                labels = [row.rig, row.service, row.id]
                up.add_metric(labels, float(row.status == "up"))
                state = states.get((row.service, row.id))
                if state is not None and state.health is not None:
                    counters.add(labels, state.health)
                    if row.status == "up":
                        gauges.add(labels, state.health)
        yield from (up, *gauges.families(), *counters.families())

    def _clocks(self) -> Iterator[Metric]:
        offsets = GaugeMetricFamily(
            "zenocap_clock_offset_seconds", "Clock of the service's machine minus the integrator's.", labels=SERVICE
        )
        errors = GaugeMetricFamily("zenocap_clock_error_seconds", "Largest error of the clock offset.", labels=SERVICE)
        skews = GaugeMetricFamily(
            "zenocap_viewer_skew_seconds",
            "Median of the viewer's capture times minus the nearest of the first viewer, on the integrator's clock.",
            labels=("rig", "viewer"),
        )
        for rig in self._observations.rigs.values():
            for row in rig.rows(self._clock.elapsed_ns()):
                if row.status == "up" and row.offset_ms is not None and row.error_ms is not None:
                    offsets.add_metric([row.rig, row.service, row.id], row.offset_ms / 1e3)
                    errors.add_metric([row.rig, row.service, row.id], row.error_ms / 1e3)
            own = rig.own_offset(self._clock.now_ns())
            if own is not None:
                offsets.add_metric([rig.rig, "metrics", "main"], own.offset_ns / 1e9)
                errors.add_metric([rig.rig, "metrics", "main"], own.error_ns / 1e9)
            for viewer, skew_s in rig.skews_s().items():
                skews.add_metric([rig.rig, viewer], skew_s)
        yield from (offsets, errors, skews)

    def _poses(self) -> Iterator[Metric]:
        poses = CounterMetricFamily(
            "zenocap_poses", "Poses received, with the person tracked or lost.", labels=("rig", "source", "state")
        )
        latency = HistogramMetricFamily(
            "zenocap_pose_latency_seconds", "Capture of the frame to receipt of its pose.", labels=("rig", "source")
        )
        for rig in self._observations.rigs.values():
            for source in sorted({source for source, _ in rig.poses}):
                poses.add_metric([rig.rig, source, "tracked"], rig.poses[source, False])
                poses.add_metric([rig.rig, source, "lost"], rig.poses[source, True])
            for source, histogram in rig.latency.items():
                latency.add_metric([rig.rig, source], _cumulative(histogram), histogram.sum_s)
        yield from (poses, latency)


class _Gauges:
    """Gauges of the services that are up."""

    def __init__(self) -> None:
        self._phases = GaugeMetricFamily("zenocap_phase", "1 for the phase of the service.", labels=(*SERVICE, "phase"))
        self._stages = GaugeMetricFamily(
            "zenocap_stage_seconds", "Median duration of the last 256 passes of a stage.", labels=(*SERVICE, "stage")
        )
        self._of_health = [GaugeMetricFamily(name, text, labels=SERVICE) for name, text, _ in HEALTH_GAUGES]
        self._of_counts = {
            key: GaugeMetricFamily(name, text, labels=SERVICE) for key, (name, text, _) in COUNT_GAUGES.items()
        }

    def add(self, labels: Sequence[str], health: Health) -> None:
        for phase in parameters.PHASES:
            self._phases.add_metric([*labels, phase], float(health.phase == phase))
        for stage in parameters.STAGES:
            if stage in health.stages_ms:
                self._stages.add_metric([*labels, stage], health.stages_ms[stage] / 1e3)
        for gauge, (_, _, value) in zip(self._of_health, HEALTH_GAUGES, strict=True):
            gauge.add_metric(labels, value(health))
        for key, gauge in self._of_counts.items():
            if key in health.counts:
                gauge.add_metric(labels, health.counts[key] * COUNT_GAUGES[key][2])

    def families(self) -> Iterator[Metric]:
        yield from (self._phases, self._stages, *self._of_health, *self._of_counts.values())


class _Counters:
    """Counters of the services, also of those that are silent."""

    def __init__(self) -> None:
        self._of_counts = {key: CounterMetricFamily(name, text, labels=SERVICE) for key, (name, text) in COUNTERS.items()}
        self._losses = CounterMetricFamily(
            "zenocap_losses", "Frames and messages lost, left out or rejected.", labels=(*SERVICE, "reason")
        )
        self._outputs = CounterMetricFamily(
            "zenocap_output_messages", "Messages of the animator's outputs, by result.", labels=("rig", "output", "result")
        )

    def add(self, labels: Sequence[str], health: Health) -> None:
        for key, counter in self._of_counts.items():
            if key in health.counts:
                counter.add_metric(labels, health.counts[key])
        for reason in EXPORTED:
            if reason in health.counts:
                self._losses.add_metric([*labels, reason], health.counts[reason])
        if health.service == "animator":
            self._add_outputs(labels[0], health)

    def _add_outputs(self, rig: str, health: Health) -> None:
        for output in parameters.OUTPUTS:
            for result in parameters.OUTPUT_RESULTS:
                if (count := health.counts.get(f"{output}_{result}")) is not None:
                    self._outputs.add_metric([rig, output, result], count)

    def families(self) -> Iterator[Metric]:
        yield from (*self._of_counts.values(), self._losses, self._outputs)


def _cumulative(histogram: Histogram) -> list[tuple[str, float]]:
    bounds = (*(f"{bound:g}" for bound in parameters.LATENCY_BUCKETS_S), "+Inf")
    total, found = 0, []
    for bound, count in zip(bounds, histogram.counts, strict=True):
        total += count
        found.append((bound, float(total)))
    return found
