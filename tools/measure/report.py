"""Results as JSON and CSV.  The functions here define the JSON format."""

import csv
import io
import platform
from collections.abc import Sequence
from pathlib import Path

import msgspec

from zenocap.common.processor import processor
from zenocap.common.runtime.service_info import versions
from zenocap.tools.measure.latency import EDGES_MS, Figures
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.ramp import Ramp
from zenocap.tools.measure.resources import Cost, title
from zenocap.tools.measure.soak import Bucket, Soak

Json = dict[str, object]

LIMITS = (
    "latency: from the moment a frame is due by the schedule to the moment its pose is queued at the measuring process, on "
    "Zenoh's thread there; it includes that process's own wait for a core",
    "frames that a viewer skips because it is late count as lost: the schedule does not wait",
    "images are rendered beforehand and read from memory: no camera, no decoding",
    "percentiles are of the frame sets that arrived; lost ones are counted separately",
)
COLUMNS = (
    "rigs", "viewers", "stand_ins", "method", "until", "rate", "width", "height", "subscribers", "mesh", "seconds",
    "offered", "completed", "partial", "lost", "offered_fps", "completed_fps", "p50_ms", "p95_ms", "p99_ms",
    "p99.9_ms", "max_ms", "view_p50_ms", "view_p99_ms", "skew_p50_ms", "skew_p99_ms", "growth_ms", "held",
    "cores_own", "cores_others", "cores", "memory_mb", "dropped", "bottleneck",
)  # fmt: skip


def report(points: Sequence[Measurement], ramp: Ramp | None = None, soak: Soak | None = None) -> bytes:
    """Return the results as indented JSON."""
    found: Json = {
        "made_with": versions(), "machine": {"processor": processor(), "system": platform.platform()}, "limits": LIMITS,
        "histogram_edges_ms": EDGES_MS, "points": [point_json(point) for point in points],
    }  # fmt: skip
    if ramp is not None:
        best = ramp.largest_held
        largest = None if best is None else best.plan
        found["ramp"] = {"what": ramp.quantity, "largest_held": largest, "failure": ramp.failure}
    if soak is not None:
        found["soak"] = soak_json(soak)
    return msgspec.json.format(msgspec.json.encode(found), indent=2) + b"\n"


def point_json(point: Measurement) -> Json:
    return {
        "plan": point.plan, "seconds": point.seconds, "ready_s": point.ready_s, **figures_json(point.figures),
        "held": point.held, "bottleneck": point.bottleneck, "cores": point.used, "dropped": point.dropped,
        "services": [cost_json(cost) for cost in point.costs],
    }  # fmt: skip


def figures_json(figures: Figures) -> Json:
    return vars(figures) | {"loss": figures.loss}


def cost_json(cost: Cost) -> Json:
    rig, service, id = cost.key
    numbers = {name: value for name, value in vars(cost).items() if name != "key"}
    return {"rig": rig, "service": service, "id": id, **numbers}


def soak_json(soak: Soak) -> Json:
    return {
        "plan": soak.plan, "flat": soak.flat, "failure": soak.failure, "dropped": soak.dropped, "trends": soak.trends,
        "restarts": soak.restarts, "buckets": [bucket_json(bucket) for bucket in soak.buckets],
    }  # fmt: skip


def bucket_json(bucket: Bucket) -> Json:
    each = [{"rig": r, "service": s, "id": i, **vars(sample)} for (r, s, i), sample in bucket.samples.items()]
    shared = {"bytes": bucket.shared[0], "files": bucket.shared[1]}
    disk = {"takes": bucket.disk[0], "others": bucket.disk[1]}
    return {"at_s": bucket.at_s, **figures_json(bucket.figures), "shared_memory": shared, "disk": disk, "processes": each}


def csv_text(points: Sequence[Measurement]) -> str:
    """CSV with a row per measurement."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for point in points:
        plan, found = point.plan, point.figures
        percentiles = (("", found.latency_ms), ("view_", found.view_ms), ("skew_", found.skew_ms))
        row = {
            **vars(plan), **vars(found),
            **{f"{of}{name}_ms": value for of, named in percentiles for name, value in named.items()},
            "width": plan.size[0], "height": plan.size[1], "seconds": point.seconds, "held": point.held,
            "cores_own": point.used.own, "cores_others": point.used.others, "cores": point.used.cores,
            "memory_mb": sum(cost.memory_bytes for cost in point.costs) / 1e6, "dropped": point.dropped,
            "bottleneck": point.bottleneck,
        }  # fmt: skip
        writer.writerow([_cell(row.get(column, "")) for column in COLUMNS])
    return text.getvalue()


def csv_of_soak(soak: Soak) -> str:
    """CSV with a row per process of each bucket, and one without process for the bucket's figures."""
    text = io.StringIO()
    writer = csv.writer(text)
    head = ("at_s", "process", "memory_mb", "handles", "threads", "offered", "completed", "p50_ms", "p99_ms")
    writer.writerow((*head, "shared_mb", "takes_mb"))
    for bucket in soak.buckets:
        at, found = f"{bucket.at_s:.1f}", bucket.figures
        latency = [_cell(found.latency_ms.get(name, "")) for name in ("p50", "p99")]
        stored = (_cell(bucket.shared[0] / 1e6), _cell(bucket.disk[0] / 1e6))
        writer.writerow((at, "", "", "", "", found.offered, found.completed, *latency, *stored))
        for key, one in sorted(bucket.samples.items()):
            writer.writerow((at, title(key), _cell(one.memory_bytes / 1e6), one.handles, one.threads, *[""] * 6))
    return text.getvalue()


def write(folder: Path, name: str, content: bytes | str) -> Path:
    """Write a file into the folder; return its path.  Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def _cell(value: object) -> object:
    return f"{value:.3f}" if isinstance(value, float) else value
