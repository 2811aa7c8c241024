"""The server of `/metrics`: what a scraper asks for, and who may ask."""

import gzip
import http.client
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

pytest.importorskip("prometheus_client", reason="prometheus-client is not installed: the extra metrics")
from prometheus_client import CollectorRegistry, Gauge
from prometheus_client.parser import text_string_to_metric_families

from zenocap.common.web.server import PageServer
from zenocap.tools.operate.metrics.shell import metrics_server

# As Prometheus sends them.
SCRAPE = {
    "User-Agent": "Prometheus/2.42.0", "Accept-Encoding": "gzip", "X-Prometheus-Scrape-Timeout-Seconds": "10",
    "Accept": "application/openmetrics-text;version=1.0.0,application/openmetrics-text;version=0.0.1;q=0.75,*/*;q=0.5",
    "Connection": "keep-alive",
}  # fmt: skip


@contextmanager
def served(host: str) -> Iterator[PageServer[object]]:
    registry = CollectorRegistry()
    for name in ("poses", "frames"):
        Gauge(name, "number", registry=registry).set(7)
    one = metrics_server(registry, host, 0)
    one.listen()
    yield one
    one.close()


@pytest.fixture
def server() -> Iterator[PageServer[object]]:
    with served("127.0.0.1") as one:
        yield one


def asked(
    server: PageServer[object], path: str = "/metrics", method: str = "GET", **headers: str
) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    return answer, answer.read()


def test_a_scrape_gets_the_format_and_encoding_that_it_asks_for(server: PageServer[object]) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    for _ in range(3):  # on one object, as a scraper that keeps connections: it connects again where the server closes
        connection.request("GET", "/metrics", headers=SCRAPE)
        answer = connection.getresponse()
        body = gzip.decompress(answer.read())
        assert (answer.status, answer.version) == (200, 11)
        assert str(answer.getheader("Content-Type")).startswith("application/openmetrics-text; version=1.0.0")
        assert body.endswith(b"# EOF\n")
    plain, text = asked(server)
    assert str(plain.getheader("Content-Type")).startswith("text/plain")
    assert [family.name for family in text_string_to_metric_families(text.decode())] == ["poses", "frames"]


def test_a_scrape_of_some_metrics(server: PageServer[object]) -> None:
    _, text = asked(server, "/metrics?name[]=frames")
    assert [family.name for family in text_string_to_metric_families(text.decode())] == ["frames"]


def test_a_head_has_the_length_and_no_body(server: PageServer[object]) -> None:
    answer, body = asked(server, method="HEAD")
    assert (answer.status, body) == (200, b"")
    assert answer.getheader("Content-Length") == str(len(asked(server)[1]))


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:9464", "[::1]:9464"])
def test_this_machine_is_answered(server: PageServer[object], host: str) -> None:
    assert asked(server, Host=host)[0].status == 200


def test_a_foreign_host_is_refused(server: PageServer[object]) -> None:
    """DNS rebinding: a page of an attacker would read the metrics."""
    answer, body = asked(server, Host="evil.example:9464")
    assert answer.status == 403
    assert b"poses" not in body


def test_a_server_for_all_machines_is_asked_by_address_or_own_name() -> None:
    """DNS rebinding needs a name of the public DNS, which is the attacker's."""
    allowed = ("192.168.1.10:9464", "[fe80::1]:9464", "localhost:9464", "studio-pc:9464", f"{socket.gethostname()}:9464")
    with served("0.0.0.0") as server:
        for host in (*allowed, "studio-pc.local"):
            assert asked(server, Host=host)[0].status == 200, host
        for host in ("evil.example:9464", "127.0.0.1.evil.example", "1.2.3.4.:9464", "[", ""):
            answer, body = asked(server, Host=host)
            assert (answer.status, b"poses" in body) == (403, False), host


def test_there_is_nothing_else(server: PageServer[object]) -> None:
    assert asked(server, "/socket")[0].status == 404
    assert asked(server, "/base.css")[0].status == 404
    assert asked(server, method="POST")[0].status != 200
