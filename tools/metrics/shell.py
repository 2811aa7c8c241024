"""`zenocap metrics`: subscribes to rigs, and serves `/metrics` over HTTP until it is stopped."""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.exposition import make_wsgi_app

from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.queries import PeriodicQueries
from zenocap.common.topics import HANDLED, HEALTH, TRACKER_POSE, UNIVERSAL_BAP
from zenocap.common.web.content import Made, PageContent
from zenocap.common.web.server import PageServer
from zenocap.tools.metrics.families import RigCollector
from zenocap.tools.metrics.observations import Observations

logger = logging.getLogger(__name__)

OWN_RIG = "zenocap-metrics"  # rig name of the connection itself, on which no service publishes
SEARCH_S = 2.0  # period of the search for rigs without a rig file; by hand
WAIT_S = 0.02  # between two looks at the queues; delays the histogram's values by nothing: receipt is stamped earlier
BATCH = 256  # events of a rig handled while the lock is held; by hand


class Exporter:
    """Readers of the rigs.  rigs: their services by name; empty for all rigs on the network."""

    def __init__(
        self, options: ZenohOptions, rigs: Mapping[str, Sequence[ServiceKey]], stopped: Callable[[], bool]
    ) -> None:
        """Open the connection.  Raises BusError, and ValueError for a bad name."""
        self._clock = RealClock()
        self._stack = ExitStack()
        self._own = self._stack.enter_context(ZenohBus.open(options, OWN_RIG, self._clock, stopped))
        self._observations = Observations(rigs)
        self._lock = threading.Lock()
        self._search, self._searched_s = not rigs, -SEARCH_S
        self._readers: dict[str, tuple[ZenohBus, PeriodicQueries]] = {}
        for rig in rigs:
            self._read(rig)

    def __enter__(self) -> "Exporter":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def collector(self) -> RigCollector:
        return RigCollector(self._observations, self._lock, self._clock)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Receive events until `stopped`."""
        while not stopped():
            if self._search:
                self._find_rigs()
            now_ns = self._clock.elapsed_ns()
            for rig, (reader, queries) in self._readers.items():
                queries.ask(now_ns, ())
                self._receive(rig, reader)
            time.sleep(WAIT_S)

    def _find_rigs(self) -> None:
        now_s = time.monotonic()
        if now_s - self._searched_s < SEARCH_S:
            return
        self._searched_s = now_s
        found = self._own.rigs()
        with self._lock:
            new = self._observations.admit(found)
        for rig in new:
            logger.info("found rig %s", rig)
            self._read(rig)

    def _read(self, rig: str) -> None:
        reader = self._stack.enter_context(self._own.reader_of(rig))
        for topic in (HEALTH, HANDLED, UNIVERSAL_BAP, TRACKER_POSE):
            reader.subscribe(topic)
        reader.watch_alive()
        self._readers[rig] = reader, PeriodicQueries(reader, self._clock.elapsed_ns(), keeps_time=False)

    def _receive(self, rig: str, reader: ZenohBus) -> None:
        observed = self._observations.rigs[rig]
        with self._lock:
            for _ in range(BATCH):
                event = reader.receive(0.0)
                if event is None:
                    return
                observed.receive(event, self._clock.elapsed_ns())


def run_metrics(
    rigs: Mapping[str, Sequence[ServiceKey]], options: ZenohOptions, host: str, port: int, stopped: Callable[[], bool]
) -> None:
    """Serve until `stopped`.  Raises UserError for an address that cannot be listened on, BusError and ValueError."""
    with Exporter(options, rigs, stopped) as exporter:
        registry = CollectorRegistry()
        registry.register(exporter.collector)
        ProcessCollector(registry=registry)
        server = metrics_server(registry, host, port)
        try:
            server.listen()
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UserError(f"--host {host} --port {port}: cannot be listened on: {reason}") from error
        logger.info("metrics are at http://%s:%d/metrics", host, server.port)
        try:
            exporter.run(stopped)
        finally:
            server.close()


def metrics_server(registry: CollectorRegistry, host: str, port: int) -> PageServer[object]:
    """The server of a registry's metrics."""
    scrape = scraped(registry)
    content: PageContent[object] = PageContent({}, None, "zenocap metrics", "--", made={"/": scrape, "/metrics": scrape})
    return PageServer(PageTable(host=host, port=port), lambda page, command: None, lambda: None, content)


def scraped(registry: CollectorRegistry) -> Made:
    """Answers a scrape in the format and encoding that its headers ask for."""
    application = make_wsgi_app(registry)

    def answer(query: str, headers: Mapping[str, str]) -> tuple[bytes, Mapping[str, str]]:
        asked = {f"HTTP_{name.upper().replace('-', '_')}": headers.get(name, "") for name in ("Accept", "Accept-Encoding")}
        fields: dict[str, str] = {}
        environ = {"REQUEST_METHOD": "GET", "PATH_INFO": "/metrics", "QUERY_STRING": query, **asked}
        body = b"".join(application(environ, lambda status, found: fields.update(found)))
        return body, fields

    return answer
