"""Messages that the network dropped before a log.

The health of a service has the number of messages that it sent before (`sent`; without those of LATCHED topics, which are
sent again).  A session's messages arrive in the order in which they were sent: between two healths of one process as many
messages must arrive as it sent.  Messages of others on its keys hide losses, as many as they are.  A replay publishes
healths of another time, and leaves out messages that they count: healths that are not new when they arrive are ignored.
"""

from dataclasses import dataclass

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.messages import Health
from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import Queueing, Topic, service_at

SENT = "sent"  # count of a health
MAX_SERVICES = 256  # whose messages are counted; chosen by hand
FRESH_NS = 3_000_000_000  # greatest age of a health at its arrival, on the integrator's clock; chosen by hand
EARLY = 2  # reports more than one a second since the last health are of another process of that name


def sender_of(topic: Topic, key: str) -> ServiceKey | None:
    """The service whose `sent` counts a message with this key; None when none does."""
    return None if topic.queueing is Queueing.LATCHED else service_at(key)


@dataclass
class _Process:
    """arrived: messages of the service so far.  last: its last health; None before the first.

    sent_before, arrived_before: at the first health of the process.  missing: of this process.
    """

    arrived: int = 0
    last: Health | None = None
    sent_before: int = 0
    arrived_before: int = 0
    missing: int = 0

    def forget(self) -> int:
        """Wait for a first health again; return the messages that are missing so far."""
        missing, self.missing, self.last = self.missing, 0, None
        return missing


class Arrivals:
    """missing: messages that were sent and did not arrive, of processes that were alive; see `Bus.watch_alive`.

    Of a process it begins with its first health and ends with its last: what is lost before and after is not known.
    """

    def __init__(self) -> None:
        self._processes: dict[ServiceKey, _Process] = {}  # those that are alive
        self._ended = 0  # missing messages of processes that are not
        self.missing = 0

    def add(self, event: Envelope | Alive) -> None:
        """Count a message, or a service that begins or ends."""
        match event:
            case Alive(service=service, id=id, alive=True):
                if len(self._processes) < MAX_SERVICES:
                    self._processes.setdefault((service, id), _Process())
            case Alive(service=service, id=id):
                ended = self._processes.pop((service, id), None)
                self._ended += ended.missing if ended else 0
            case Envelope(topic=topic, key=key, message=message, received_ns=received_ns):
                sender = sender_of(topic, key)
                process = self._processes.get(sender) if sender is not None else None
                if process is None:
                    return
                if isinstance(message, Health) and SENT in message.counts:
                    if abs(received_ns - (message.captured_ns - message.clock_offset_ns)) > FRESH_NS:
                        self._ended += process.forget()
                    else:
                        self._compare(process, message)
                process.arrived += 1

    def _compare(self, process: _Process, health: Health) -> None:
        if process.last is None or not _same_process(process.last, health):
            self._ended += process.forget()
            process.sent_before, process.arrived_before = health.counts[SENT], process.arrived
        sent, arrived = health.counts[SENT] - process.sent_before, process.arrived - process.arrived_before
        process.missing = max(0, sent - arrived)
        process.last = health
        self.missing = self._ended + sum(each.missing for each in self._processes.values())


def _same_process(before: Health, after: Health) -> bool:
    """Whether two healths are of one process: the numbers of its reports rise by at most one a second."""
    reports, elapsed_s = after.frame - before.frame, (after.captured_ns - before.captured_ns) / 1e9
    return 0 < reports <= elapsed_s + EARLY and after.counts[SENT] >= before.counts[SENT]
