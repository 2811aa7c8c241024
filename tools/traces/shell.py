"""`zenocap traces`: subscribes to rigs and sends the ways of their instants until it is stopped."""

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack

from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.queries import PeriodicQueries
from zenocap.common.topics import ASSIGNMENT, HEALTH, PARTIAL_BAP, SIGHTING, SILHOUETTE, TRACKER_POSE, UNIVERSAL_BAP
from zenocap.tools.traces.export import WayExporter
from zenocap.tools.traces.instants import Instants

logger = logging.getLogger(__name__)

OWN_RIG = "zenocap-traces"  # rig name of the connection itself, on which no service publishes
WAIT_S = 0.02  # between two looks at the queues; receipt is stamped earlier
BATCH = 256  # events of a rig between two looks at the others
TOPICS_READ = (HEALTH, SILHOUETTE, SIGHTING, ASSIGNMENT, PARTIAL_BAP, TRACKER_POSE, UNIVERSAL_BAP)


def run_traces(
    rigs: Sequence[str], options: ZenohOptions, endpoint: str, every: int, stopped: Callable[[], bool]
) -> tuple[int, int]:
    """Send traces until `stopped`; numbers of traced instants and of undelivered spans.

    Raises BusError, and ValueError for a bad name.
    """
    clock, exporter = RealClock(), WayExporter(endpoint)
    try:
        with ExitStack() as stack:
            own = stack.enter_context(ZenohBus.open(options, OWN_RIG, clock, stopped))
            readers = {}
            for rig in rigs:
                reader = stack.enter_context(own.reader_of(rig))
                for topic in TOPICS_READ:
                    reader.subscribe(topic, every=True)
                readers[rig] = reader, PeriodicQueries(reader, clock.elapsed_ns(), keeps_time=False), Instants(rig, every)
            while not stopped():
                now_ns = clock.elapsed_ns()
                for rig, (reader, queries, instants) in readers.items():
                    queries.ask(now_ns, ())
                    for _ in range(BATCH):
                        event = reader.receive(0.0)
                        if event is None:
                            break
                        way = instants.receive(event)
                        if way is not None:
                            exporter.send(rig, way)
                time.sleep(WAIT_S)
    finally:
        exporter.close()
    return exporter.sent, exporter.lost
