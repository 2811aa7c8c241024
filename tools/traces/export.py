"""Ways of instants as OpenTelemetry spans, sent with OTLP over HTTP; every service of a rig is a service of the trace."""

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter
from opentelemetry.trace import Tracer, set_span_in_context

from zenocap.common.runtime.service_info import versions
from zenocap.tools.traces.instants import InstantWay, Part
from zenocap.tools.traces.parameters import EXPORT_TIMEOUT_S

MOST_SERVICES = 256  # names of services from the network, of which each has a tracer; further ones are left out


class WayExporter:
    """Sends ways until `close`.  A collector that does not answer loses spans, and delays nothing."""

    def __init__(self, endpoint: str, exporter: SpanExporter | None = None) -> None:
        """exporter: instead of OTLP over HTTP to `endpoint`."""
        self._processor = BatchSpanProcessor(exporter or OTLPSpanExporter(endpoint=endpoint, timeout=EXPORT_TIMEOUT_S))
        self._tracers: dict[tuple[str, str], Tracer] = {}
        self._version = versions()["zenocap"]
        self.sent = 0

    def send(self, rig: str, way: InstantWay) -> None:
        """Queue the spans of one way."""
        whole = way.whole
        tracer = self._tracer(rig, whole)
        if tracer is None:
            return
        root = tracer.start_span(whole.name, start_time=whole.begin_ns, attributes=whole.attributes)
        context = set_span_in_context(root)
        for part in way.parts:
            own = self._tracer(rig, part)
            if own is not None:
                span = own.start_span(part.name, context, start_time=part.begin_ns, attributes=part.attributes)
                span.end(part.end_ns)
        root.end(whole.end_ns)
        self.sent += 1

    def close(self) -> None:
        """Send what waits, EXPORT_TIMEOUT_S at most."""
        self._processor.force_flush(round(1e3 * EXPORT_TIMEOUT_S))
        self._processor.shutdown()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"

    def _tracer(self, rig: str, part: Part) -> Tracer | None:
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
