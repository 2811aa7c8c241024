"""`zenocap traces`: latency spans of frame sets to OpenTelemetry, with OTLP over HTTP.

Each frame set is a trace, and each service of a rig a service of it.
"""

import threading
import time
from collections.abc import Callable, Sequence

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import ReadableSpan, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter, SpanExportResult
from opentelemetry.trace import Tracer, set_span_in_context
from requests import Session

from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.observe.spans import FrameSetSpans, Span, SpanReader
from zenocap.common.observe.watch import Watch
from zenocap.common.runtime.service_info import versions
from zenocap.common.topics import ASSIGNMENT, HEALTH, PARTIAL_BAP, SIGHTING, SILHOUETTE, TRACKER_POSE, UNIVERSAL_BAP

EXPORT_TIMEOUT_S = 5.0
WAIT_S = 0.02  # between two looks at the queues; receipt is stamped earlier
TOPICS_READ = (HEALTH, SILHOUETTE, SIGHTING, ASSIGNMENT, PARTIAL_BAP, TRACKER_POSE, UNIVERSAL_BAP)
MOST_SERVICES = 256  # names of services from the network, of which each has a tracer; further ones are left out


class _Counted(SpanExporter):
    """Counts the spans that were delivered."""

    def __init__(self, exporter: SpanExporter) -> None:
        self._exporter, self.delivered = exporter, 0

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        result = self._exporter.export(spans)
        self.delivered += len(spans) if result is SpanExportResult.SUCCESS else 0
        return result

    def shutdown(self) -> None:
        self._exporter.shutdown()


def run_traces(
    rigs: Sequence[str], options: ZenohOptions, endpoint: str, every: int, stopped: Callable[[], bool]
) -> tuple[int, int]:
    """Send traces until `stopped`; numbers of traced frame sets and of undelivered spans.

    Raises BusError, and ValueError for a bad name.
    """
    exporter, readers = FrameSetExporter(endpoint), {rig: SpanReader(rig, every) for rig in rigs}
    try:
        with Watch(options, "traces", rigs, TOPICS_READ, stopped, every=True, clock=True) as watch:
            while not stopped():
                for rig, event, _ in watch.events():
                    spans = readers[rig].receive(event)
                    if spans is not None:
                        exporter.send(rig, spans)
                time.sleep(WAIT_S)
    finally:
        exporter.close()
    return exporter.sent, exporter.lost


class FrameSetExporter:
    """Sends spans until `close`.  A collector that does not answer loses spans, and delays nothing.

    sent: number of frame sets.  lost: of their spans, after `close`.
    """

    def __init__(self, endpoint: str, exporter: SpanExporter | None = None) -> None:
        """exporter: instead of OTLP over HTTP to `endpoint`."""
        session = Session()
        session.stream = True  # an answer without an end is not read
        self._counted = _Counted(exporter or OTLPSpanExporter(endpoint=endpoint, timeout=EXPORT_TIMEOUT_S, session=session))
        self._processor = BatchSpanProcessor(self._counted)
        self._tracers: dict[tuple[str, str], Tracer] = {}
        self._version = versions()["zenocap"]
        self.sent = self._spans = 0

    @property
    def lost(self) -> int:
        """Spans that no collector has taken."""
        return self._spans - self._counted.delivered

    def send(self, rig: str, spans: FrameSetSpans) -> None:
        """Queue the spans of one frame set."""
        whole = spans.whole
        tracer = self._tracer(rig, whole)
        if tracer is None:
            return
        root = tracer.start_span(whole.name, start_time=whole.begin_ns, attributes=whole.attributes)
        context = set_span_in_context(root)
        for part in spans.parts:
            own = self._tracer(rig, part)
            if own is not None:
                span = own.start_span(part.name, context, start_time=part.begin_ns, attributes=part.attributes)
                span.end(part.end_ns)
                self._spans += 1
        root.end(whole.end_ns)
        self.sent, self._spans = self.sent + 1, self._spans + 1

    def close(self) -> None:
        """Send what waits, EXPORT_TIMEOUT_S at most: the timeouts of the library begin anew with each byte of an answer."""
        closing = threading.Thread(target=self._processor.shutdown, name="close traces", daemon=True)
        closing.start()
        closing.join(EXPORT_TIMEOUT_S)

    def _tracer(self, rig: str, part: Span) -> Tracer | None:
        key = rig, part.service
        if key not in self._tracers:
            if len(self._tracers) >= MOST_SERVICES:
                return None
            resource = Resource.create(
                {"service.namespace": rig, "service.name": f"zenocap {part.service}", "service.version": self._version}
            )
            provider = TracerProvider(resource=resource, shutdown_on_exit=False)
            provider.add_span_processor(self._processor)
            self._tracers[key] = provider.get_tracer("zenocap")
        return self._tracers[key]
