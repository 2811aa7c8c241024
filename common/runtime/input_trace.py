"""The ordered inputs of a service's step, from which `zenocap verify` recomputes its messages."""

from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.messages import Handled

FULL = 256  # largest number of events in a message

FRAME, TICK, ALIVE, GONE = "frame", "tick", "alive", "gone"


def name_and_time(event: FrameLike | Envelope | Alive | Tick) -> tuple[str, int]:
    """Name of an event in a `Handled` message, and its time in nanoseconds since the Unix epoch."""
    match event:
        case Envelope(key=key, message=message):
            return key, message.captured_ns
        case Alive(service=service, id=id, alive=alive, received_ns=received_ns):
            return f"{ALIVE if alive else GONE}/{service}/{id}", received_ns
        case Tick(received_ns=received_ns):
            return TICK, received_ns
        case _:
            return FRAME, event.captured_ns


def kind_of(event: FrameLike | Envelope | Alive | Tick) -> str:
    """Kind of an event, for times and counts by kind."""
    match event:
        case Envelope(topic=topic):
            return topic.name
        case Alive():
            return "alive"
        case Tick():
            return TICK
        case _:
            return FRAME


def event_text(event: FrameLike | Envelope | Alive | Tick) -> str:
    """Description of an event for the log."""
    match event:
        case Envelope(key=key, message=message):
            return f"{key} frame {message.frame}"
        case Alive(service=service, id=id, alive=alive):
            return f"{service} {id} {'appeared' if alive else 'disappeared'}"
        case Tick(received_ns=received_ns):
            return f"tick at {received_ns}"
        case _:
            return f"frame {event.frame}"


class Trace:
    """The events of one service since its last `Handled`."""

    def __init__(self, service: str, id: str) -> None:
        self._service, self._id = service, id
        self._first = self._reports = 0
        self._keys: dict[str, int] = {}
        self._events: list[tuple[int, int]] = []

    @property
    def full(self) -> bool:
        """Whether the message must be sent before the next event."""
        return len(self._events) >= FULL

    def add(self, event: FrameLike | Envelope | Alive | Tick) -> None:
        name, time_ns = name_and_time(event)
        self._events.append((self._keys.setdefault(name, len(self._keys)), time_ns))

    def take_back(self) -> None:
        """Leave out the last event."""
        self._events.pop()

    def report(self, now_ns: int) -> Handled | None:
        """Return the events since the last report and clear them; None without any."""
        if not self._events:
            return None
        handled = Handled(
            frame=self._reports, captured_ns=now_ns, service=self._service, id=self._id, first=self._first,
            keys=list(self._keys), events=self._events,
        )  # fmt: skip
        self._reports += 1
        self._first += len(self._events)
        self._keys, self._events = {}, []
        return handled
