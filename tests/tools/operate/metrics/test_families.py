"""Exported metrics, read by prometheus-client; names of the Grafana dashboard."""

import json
import re
import threading
from collections.abc import Mapping

import pytest

pytest.importorskip("prometheus_client", reason="prometheus-client is not installed: the extra metrics")
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from tests.support.animator_stand_in import health, received
from tests.support.places import ROOT
from tests.tools.operate.metrics.test_observations import EXPECTED, MS, NOW_NS, S, pose, traced
from zenocap.common import messages as m
from zenocap.common.bus.protocol import RoundTrip
from zenocap.common.runtime.clock import ManualClock
from zenocap.tools.operate.metrics.families import RigCollector
from zenocap.tools.operate.metrics.observations import Observations
from zenocap.tools.operate.metrics.parameters import PHASES

Samples = Mapping[tuple[str, frozenset[tuple[str, str]]], float]


def scraped(observations: Observations, now_ns: int = NOW_NS) -> Samples:
    """Samples by name and labels, after encoding and parsing."""
    registry = CollectorRegistry()
    registry.register(RigCollector(observations, threading.Lock(), ManualClock(now_ns)))
    text = generate_latest(registry).decode()
    return {
        (sample.name, frozenset(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def value(samples: Samples, name: str, **labels: str) -> float:
    return samples[name, frozenset(labels.items())]


def observed() -> Observations:
    """A rig in which every metric has a value."""
    observations = Observations({"studio": (*EXPECTED, ("integrator", "main"), ("animator", "main"))})
    rig = observations.rigs["studio"]
    rig.receive(RoundTrip(NOW_NS, NOW_NS, NOW_NS + MS), NOW_NS)
    counts: dict[tuple[str, str], dict[str, int]] = {
        ("viewer", "1"): {"frames": 90, "published": 180, "received": 20, "dropped_frames": 4, "kept_percent": 67},
        ("viewer", "2"): {"frames": 91, "dropped_superseded": 3, "queued": 5},
        ("integrator", "main"): {"log_on": 1, "log_stopped": 0, "log_free_mb": 2500, "log_messages": 1000}
        | {"log_lost": 1, "certificate_days": 3},
        ("tracker", "main"): {"silhouette_late": 6, "rejected_invalid": 7, "no_such_reason": 99},
        ("animator", "main"): {"vmc_sent": 30, "vmc_refused": 2, "strange_sent": 5},
    }
    messages = [health(service, id, NOW_NS, **found) for (service, id), found in counts.items()]
    for message in (*messages, traced([("1", NOW_NS), ("2", NOW_NS + 2 * MS)]), pose(NOW_NS - 18 * MS)):
        rig.receive(received(message, NOW_NS, "studio"), NOW_NS)
    return observations


def test_values_of_the_health_messages_are_exported() -> None:
    samples = scraped(observed())
    for name, place, expected in (
        ("zenocap_up", "viewer 1", 1),
        ("zenocap_frames_total", "viewer 1", 90),
        ("zenocap_messages_published_total", "viewer 1", 180),
        ("zenocap_messages_received_total", "viewer 1", 20),
        ("zenocap_frame_share", "viewer 1", 0.67),
        ("zenocap_clock_offset_seconds", "viewer 1", 120e-6),
        ("zenocap_clock_error_seconds", "viewer 1", 300e-6),
        ("zenocap_stage_seconds", "viewer 1 stage=frame_age", 1.5e-3),
        ("zenocap_memory_bytes", "viewer 1", 180e6),
        ("zenocap_losses_total", "viewer 1 reason=dropped_frames", 4),
        ("zenocap_losses_total", "tracker main reason=silhouette_late", 6),
        ("zenocap_losses_total", "integrator main reason=log_lost", 1),
        ("zenocap_log_free_bytes", "integrator main", 2.5e9),
        ("zenocap_certificate_left_seconds", "integrator main", 3 * 86_400),
    ):
        service, id, *more = place.split()
        labels = {"service": service, "id": id} | dict(one.split("=") for one in more)
        assert value(samples, name, rig="studio", **labels) == pytest.approx(expected), (name, place)
    assert value(samples, "zenocap_viewer_skew_seconds", rig="studio", viewer="2") == pytest.approx(2e-3)
    assert value(samples, "zenocap_output_messages_total", rig="studio", output="vmc", result="refused") == 2
    assert value(samples, "zenocap_poses_total", rig="studio", source="tracker", state="tracked") == 1


def test_the_phase_is_a_set_of_states_of_which_one_is_1() -> None:
    samples = scraped(observed())
    tracker = {"rig": "studio", "service": "tracker", "id": "main"}
    phases = {phase: value(samples, "zenocap_phase", **tracker, phase=phase) for phase in PHASES}
    assert phases == {phase: float(phase == m.Phase.TRACKING) for phase in PHASES}


def test_the_histogram_is_cumulative() -> None:
    samples = scraped(observed())
    labels = {"rig": "studio", "source": "tracker"}
    buckets = {
        dict(key)["le"]: count for (name, key), count in samples.items() if name == "zenocap_pose_latency_seconds_bucket"
    }
    assert (buckets["0.015"], buckets["0.02"], buckets["+Inf"]) == (0, 1, 1)
    assert value(samples, "zenocap_pose_latency_seconds_count", **labels) == 1
    assert value(samples, "zenocap_pose_latency_seconds_sum", **labels) == pytest.approx(0.018, abs=1e-3)


def test_names_in_messages_do_not_become_labels() -> None:
    rig = Observations({"studio": EXPECTED})
    for k in range(50):
        message = m.Health(
            frame=k, captured_ns=NOW_NS, service="viewer", id="1", state="x", rate=1.0, stages_ms={f"stage{k}": 1.0},
            counts={f"count{k}": 1, f"dropped_{k}": 1, f"rejected_{k}": 1, f"silhouette_{k}": 1, f"vmc_{k}": 1},
        )  # fmt: skip
        rig.rigs["studio"].receive(received(message, NOW_NS, "studio"), NOW_NS)
    before = len(scraped(Observations({"studio": EXPECTED})))
    found = scraped(rig)
    assert not [key for key in found if re.search(r"(stage|count|dropped_|rejected_|silhouette_|vmc_)\d", str(key))]
    assert len(found) < before + 30


def test_gauges_of_a_silent_service_are_left_out_and_a_missing_one_is_not_up() -> None:
    viewer = {"rig": "studio", "service": "viewer", "id": "1"}
    samples = scraped(observed(), NOW_NS + 10 * S)
    assert value(samples, "zenocap_up", **viewer) == 0
    assert value(samples, "zenocap_frames_total", **viewer) == 90
    assert ("zenocap_rate_hertz", frozenset(viewer.items())) not in samples
    empty = scraped(Observations({"studio": EXPECTED}))
    assert value(empty, "zenocap_up", **viewer) == 0


def test_versions_and_ignored_messages_are_exported() -> None:
    samples = scraped(observed())
    ((_, build),) = [key for key in samples if key[0] == "zenocap_build_info"]
    assert set(dict(build)) == {"version", "python", "zenoh"}
    assert value(samples, "zenocap_metrics_ignored_total", what="service") == 0


def dashboard_queries() -> list[str]:
    dashboard = json.loads((ROOT / "deploy" / "grafana" / "zenocap.json").read_text())
    panels = [panel for row in dashboard["panels"] for panel in (row, *row.get("panels", ()))]
    queries = [target["expr"] for panel in panels for target in panel.get("targets", ())]
    return [*queries, *(one["query"]["query"] for one in dashboard["templating"]["list"] if one["type"] == "query")]


def test_the_dashboard_and_the_alerts_use_only_metrics_and_labels_that_exist() -> None:
    samples = scraped(observed())
    names = {name for name, _ in samples}
    labels = {label for _, found in samples for label, _ in found}
    rules = (ROOT / "deploy" / "prometheus" / "alerts.yml").read_text()
    queries = [*dashboard_queries(), *re.findall(r"expr: (.*)", rules)]
    assert len(queries) > 15
    used: set[str] = set()
    for query in queries:
        found = set(re.findall(r"\bzenocap_\w+", query))
        assert found, query
        assert found <= names, (query, found - names)
        groups = re.findall(r"(?:by|on|ignoring) \(([\w, ]*)\)", query)
        filters = re.findall(r"(\w+)\s*(?:=~|!=|=|!~)\s*\"", query)
        assert {*filters, *(label for group in groups for label in group.split(", "))} <= labels, query
        used |= {re.sub("_(bucket|sum|count)$", "", name) for name in found}
    exported = {re.sub("_(bucket|sum|count)$", "", name) for name in names if name.startswith("zenocap_")}
    assert exported - used <= {"zenocap_log_messages_total", "zenocap_messages_superseded_total"}, exported - used
