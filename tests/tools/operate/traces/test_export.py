"""Spans as a collector receives them, decoded with OpenTelemetry's own messages."""

import socket
import threading
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from zenocap.common.observe.spans import FrameSetSpans, Span

pytest.importorskip("opentelemetry.sdk", reason="opentelemetry is not installed")
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.trace.export import SpanExporter, SpanExportResult

from zenocap.tools.operate.traces import export
from zenocap.tools.operate.traces.export import FrameSetExporter

SPANS = FrameSetSpans(
    Span("rig", "pose by tracker", 1_000, 9_000, {"zenocap.frame": 7, "zenocap.lost": False}),
    (Span("viewer 1", "silhouette", 1_000, 4_000), Span("tracker", "pose", 4_000, 9_000)),
)


@pytest.fixture
def collector():
    """URL of an OTLP receiver, and the requests that it received."""
    requests = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            requests.append(ExportTraceServiceRequest.FromString(body))
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/v1/traces", requests
    server.shutdown()
    server.server_close()


@pytest.mark.slow
def test_a_collector_receives_the_spans_of_an_instant(collector):
    url, requests = collector
    exporter = FrameSetExporter(url)
    exporter.send("studio", SPANS)
    exporter.close()
    assert (exporter.sent, exporter.lost) == (1, 0)
    found = {}
    for request in requests:
        for group in request.resource_spans:
            names = {one.key: one.value.string_value for one in group.resource.attributes}
            assert names["service.namespace"] == "studio"
            for scope in group.scope_spans:
                (found[names["service.name"]],) = scope.spans
    assert set(found) == {"zenocap rig", "zenocap viewer 1", "zenocap tracker"}
    root = found["zenocap rig"]
    assert (root.start_time_unix_nano, root.end_time_unix_nano) == (1_000, 9_000)
    for name in ("zenocap viewer 1", "zenocap tracker"):
        assert found[name].parent_span_id == root.span_id
        assert found[name].trace_id == root.trace_id
    assert (found["zenocap tracker"].start_time_unix_nano, found["zenocap tracker"].end_time_unix_nano) == (4_000, 9_000)
    assert {one.key for one in root.attributes} == {"zenocap.frame", "zenocap.lost"}


@pytest.mark.slow
def test_a_collector_whose_answer_has_no_end_delays_no_end_and_has_taken_the_spans():
    def answer(server, ended):
        peer, _ = server.accept()
        with peer, suppress(OSError):
            peer.recv(1 << 16)
            peer.sendall(b"HTTP/1.1 200 OK\r\n\r\n")
            while not ended.wait(0.1):
                peer.sendall(b"x")

    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=answer, args=(server, ended))
        thread.start()
        exporter = FrameSetExporter(f"http://127.0.0.1:{server.getsockname()[1]}/v1/traces")
        exporter.send("studio", SPANS)
        exporter.close()
        assert (exporter.sent, exporter.lost) == (1, 0)
        ended.set()
        thread.join()


@pytest.mark.slow
def test_a_collector_that_never_answers_is_left(monkeypatch):
    monkeypatch.setattr(export, "EXPORT_TIMEOUT_S", 0.2)
    released = threading.Event()

    class Hanging(SpanExporter):
        def export(self, spans):
            released.wait()
            return SpanExportResult.FAILURE

    exporter = FrameSetExporter("", Hanging())
    exporter.send("studio", SPANS)
    exporter.close()  # returns
    assert exporter.lost == 3
    released.set()


def test_spans_that_no_collector_takes_are_counted():
    class Refusing(SpanExporter):
        def export(self, spans):
            return SpanExportResult.FAILURE

    exporter = FrameSetExporter("", Refusing())
    exporter.send("studio", SPANS)
    exporter.close()
    assert (exporter.sent, exporter.lost) == (1, 3)
