"""`zenocap metrics`: subscribes to rigs, and serves `/metrics` over HTTP until it is stopped."""

import logging
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.exposition import make_wsgi_app

from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.observe.watch import Watch
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import HANDLED, HEALTH, TRACKER_POSE, UNIVERSAL_BAP
from zenocap.common.web.content import Made, PageContent
from zenocap.common.web.server import PageServer, listening_problem
from zenocap.tools.operate.metrics.families import RigCollector
from zenocap.tools.operate.metrics.observations import Observations

logger = logging.getLogger(__name__)

WAIT_S = 0.02  # between two looks at the queues; delays the histogram's values by nothing: receipt is stamped earlier
TOPICS_READ = (HEALTH, HANDLED, UNIVERSAL_BAP, TRACKER_POSE)


def run_metrics(
    rigs: Mapping[str, Sequence[ServiceKey]], options: ZenohOptions, host: str, port: int, stopped: Callable[[], bool]
) -> None:
    """Serve until `stopped`.  Raises UserError for an address that cannot be listened on, BusError and ValueError.

    rigs: their services by name; empty for all rigs on the network.
    """
    observations, lock = Observations(rigs), threading.Lock()

    def admitted(found: Collection[str]) -> Sequence[str]:
        with lock:
            new = observations.admit(found)
        for rig in new:
            logger.info("found rig %s", rig)
        return new

    with Watch(options, "metrics", rigs, TOPICS_READ, stopped, clock=True, admitted=admitted) as watch:
        registry = CollectorRegistry()
        registry.register(RigCollector(observations, lock, RealClock()))
        ProcessCollector(registry=registry)
        server = metrics_server(registry, host, port)
        try:
            server.listen()
        except (OSError, UnicodeError) as error:
            raise UserError(f"--host {host} --port {port}: cannot be listened on: {listening_problem(error)}") from error
        logger.info("metrics are at http://%s:%d/metrics", host, server.port)
        try:
            while not stopped():
                for rig, event, at_ns in watch.events():
                    with lock:
                        observations.rigs[rig].receive(event, at_ns)
                time.sleep(WAIT_S)
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
