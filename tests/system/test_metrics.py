"""`zenocap metrics` beside a real rig, scraped over HTTP, and by Prometheus where that is installed."""

import json
import shutil
import socket
import subprocess
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("prometheus_client", reason="prometheus-client is not installed: the extra metrics")
from prometheus_client.parser import text_string_to_metric_families

from tests.support.processes import PATIENCE_S, ended, output_of, run, started, wait_until
from tests.support.session_rigs import SessionRig
from tests.tools.operate.metrics.test_families import dashboard_queries
from zenocap.common.bus.zenoh_session import free_ports

pytestmark = pytest.mark.nightly
SERVICES = 7  # three viewers, integrator, tracker, recognizer, animator
VIEWERS = 3
# Queries that have no result while nothing is lost, and unless a viewer is overloaded.
MAY_BE_EMPTY = ("zenocap_losses_total", "zenocap_frame_share")


def fetched(url: str) -> str:
    with urllib.request.urlopen(url, timeout=30) as answer:
        text: str = answer.read().decode()
    return text


class Scraper:
    """Samples of one page by name, each with its labels and value."""

    def __init__(self, port: int) -> None:
        self.url = f"http://127.0.0.1:{port}/metrics"
        self.text = ""

    def total(self, name: str, **labels: str) -> float:
        """Sum of the samples with these labels, of a new scrape; 0 without one."""
        try:
            self.text = fetched(self.url)
        except OSError:
            return 0.0
        return sum(self.values(name, **labels))

    def values(self, name: str, **labels: str) -> list[float]:
        """Values of the last scrape."""
        return [
            sample.value
            for family in text_string_to_metric_families(self.text)
            for sample in family.samples
            if sample.name == name and labels.items() <= sample.labels.items()
        ]


@contextmanager
def prometheus(folder: Path, target: str) -> Iterator[str]:
    """A Prometheus that scrapes `target` every second; its address."""
    (port,) = free_ports(1)
    config = folder / "prometheus.yml"
    jobs = [{"job_name": "zenocap", "static_configs": [{"targets": [target]}]}]
    config.write_text(json.dumps({"global": {"scrape_interval": "1s"}, "scrape_configs": jobs}))
    command = [
        "prometheus", f"--config.file={config}", f"--storage.tsdb.path={folder / 'tsdb'}",
        f"--web.listen-address=127.0.0.1:{port}",
    ]  # fmt: skip
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


def result(server: str, query: str) -> list[object]:
    """Result of a query of the dashboard at this time; its variables stand for everything."""
    query = query.replace("$__rate_interval", "10s").replace("$rig", ".*")
    if query.startswith("label_values("):
        query = query.removeprefix("label_values(").split(",")[0]
    answer = json.loads(fetched(f"{server}/api/v1/query?{urllib.parse.urlencode({'query': query})}"))
    assert answer["status"] == "success", query
    found: list[object] = answer["data"]["result"]
    return found


def answers(server: str) -> bool:
    try:
        return len(result(server, "zenocap_up[10s]")) > 3
    except OSError:
        return False


def test_a_running_rig_is_scraped_and_every_query_of_the_dashboard_has_a_result(
    ring_rig: SessionRig, tmp_path: Path
) -> None:
    """It ends the rig."""
    (port,) = free_ports(1)
    scraper = Scraper(port)
    with started(["metrics", ring_rig.file, "-m", "client", "-e", ring_rig.endpoint, "--port", port], tmp_path) as exporter:
        wait_until(lambda: scraper.total("zenocap_poses_total", state="tracked") > 60, tmp_path)
        wait_until(lambda: len(scraper.values("zenocap_viewer_skew_seconds")) == VIEWERS, tmp_path)
        check_samples(scraper)
        if shutil.which("prometheus"):
            with prometheus(tmp_path, f"127.0.0.1:{port}") as server:
                wait_until(lambda: answers(server), tmp_path)
                wait_until(lambda: not queries_without_result(server), tmp_path)
        if shutil.which("promtool"):
            found = subprocess.run(
                ["promtool", "check", "metrics"], input=scraper.text, capture_output=True, text=True, check=False
            )
            assert (found.returncode, found.stderr) == (0, "")
        ring_rig.end()
        wait_until(lambda: scraper.total("zenocap_up") == 0, tmp_path)
        assert len(scraper.values("zenocap_up")) == SERVICES
        assert ended(exporter) == 0, output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)


def check_samples(scraper: Scraper) -> None:
    assert scraper.total("zenocap_up") == SERVICES
    assert scraper.values("zenocap_phase", service="tracker", phase="tracking") == [1]
    assert scraper.values("zenocap_build_info") == [1]
    count, total_s = (scraper.values(f"zenocap_pose_latency_seconds_{kind}")[0] for kind in ("count", "sum"))
    assert count > 30
    assert 0.001 < total_s / count < 10.0
    assert max(map(abs, scraper.values("zenocap_viewer_skew_seconds"))) < 0.02
    assert max(map(abs, scraper.values("zenocap_clock_offset_seconds"))) < 0.1  # one machine
    assert scraper.values("zenocap_log_recording") == [1]
    assert scraper.values("zenocap_log_free_bytes")[0] > 1e6
    assert scraper.values("zenocap_output_messages_total", output="udp", result="sent")[0] > 10
    assert len(scraper.values("zenocap_cores")) == SERVICES
    assert len(scraper.values("zenocap_queued_messages")) == SERVICES
    assert scraper.values("process_cpu_seconds_total")[0] > 0


def queries_without_result(server: str) -> list[str]:
    return [
        query for query in dashboard_queries()
        if not result(server, query) and not any(name in query for name in MAY_BE_EMPTY)
    ]  # fmt: skip


def test_a_port_in_use_is_reported_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        status, text = run(tmp_path, "metrics", "--no-multicast-scouting", "--port", port)
    assert status == 1
    assert f"error: --host 127.0.0.1 --port {port}: cannot be listened on: Address already in use" in text
