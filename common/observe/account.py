"""Account of a rig's messages: sent by each service, received by the logs.  O(1) a message.

The healths of a process say how many messages of each topic it has sent before them (`sent.TOPIC`; without those of LATCHED
topics, which are sent again).  A session's messages arrive in the order in which they were sent: between two healths as
many messages must arrive as it sent.  Messages of others on its keys hide losses, as many as they are.  A replay publishes
healths of another time, and leaves out messages that they count: healths that are not new on arrival are ignored.  What a
process sent after its last health is in no count, only the time is known; unless that says that it is the last (`ended`).
"""

from collections.abc import Collection, Iterable, Mapping

import msgspec

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.messages import ENDED, PROCESS, SENT, Health, Nanoseconds
from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import HEALTH, TOPICS, Queueing, Topic, service_at, topic_at

METADATA = "account"  # name in a take
MAX_SERVICES = 256  # whose messages are counted, besides the rig's own; chosen by hand
MAX_LIVES = 1024  # processes of each of its own services, and of all others together; chosen by hand
MAX_STEPS = 256  # of the clock; chosen by hand
FRESH_NS = 3_000_000_000  # by which a health is older than its arrival, at most, on the integrator's clock; chosen by hand
HEALTH_NS = 1_100_000_000  # a clock is set at most so long after an event, and before the next: healths come each second
STEP_NS = 100_000_000  # by which events of several threads are out of order, at most; chosen by hand
COUNTED = {SENT + topic.name: topic.name for topic in TOPICS}

Span = tuple[Nanoseconds, Nanoseconds]  # log times
Counts = dict[str, int]  # by name of the topic


class Line(msgspec.Struct, frozen=True):
    """Messages of one topic of one service: sent == seen + missing + unlogged, and none is negative.

    seen: received by a log.  missing: not received although one was on.  unlogged: sent while none was.
    unknown: times at which it sent further ones that are in no count.
    """

    sent: int
    seen: int
    missing: int
    unlogged: int
    unknown: tuple[Span, ...]


class Report(msgspec.Struct, frozen=True):
    """A health.  at_ns, step: log time, and how often its clock was set back before.

    sent, seen: before this health, or with it if it is the last of its process (ended).
    """

    at_ns: Nanoseconds
    step: int
    sent: Counts
    seen: Counts
    ended: bool = False


class Life(msgspec.Struct):
    """One process.  missing, unlogged: of its messages, besides those missing between both reports.

    off: of `unlogged`, those between both reports.  gone_ns: log time of the end of its token, or 0.
    unknown: times without a count; None: from the last report on.
    """

    first: Report
    last: Report
    missing: Counts = {}
    unlogged: Counts = {}
    off: Counts = {}
    gone_ns: Nanoseconds = 0
    unknown: list[Span] | None = None


class Sender(msgspec.Struct):
    """One service.  seen: its messages.  lives: by random number of the process, in order."""

    seen: Counts = {}
    lives: dict[int, Life] = {}


class Account:
    """The messages of one log, or of several in order.

    senders: by service.  own: those of the rig, which always have a place.  missing: sum of the lines'.
    dropped: by the full queue of a log; messages among them are missing.
    end_ns: time of the last event.  steps: log times around those at which the clock was set back.
    """

    def __init__(
        self, senders: Mapping[ServiceKey, Sender] | None = None, end_ns: int = 0, steps: Iterable[Span] = (),
        dropped: int = 0, own: Collection[ServiceKey] = (),
    ) -> None:  # fmt: skip
        self.senders, self.own = dict(senders or {}), frozenset(own)
        self.steps = list(steps)
        self._others = sum(len(one.lives) for service, one in self.senders.items() if service not in self.own)  # lives
        self._places: dict[str, tuple[ServiceKey, str]] = {}  # by key: the service, and the name of the topic
        self.missing = sum(sum(missing_of(life).values()) for one in self.senders.values() for life in one.lives.values())
        self.end_ns, self.dropped = end_ns, dropped

    def add(self, event: Envelope | Alive) -> None:
        """Count a message, or note that a service has ended."""
        if isinstance(event, Envelope):
            self.add_message(event.key, event.received_ns, event.message if isinstance(event.message, Health) else None)
            return
        self._pass(event.received_ns)
        if not event.alive:
            sender = self.senders.get((event.service, event.id))
            if sender is not None and sender.lives:
                next(reversed(sender.lives.values())).gone_ns = event.received_ns

    def add_message(self, key: str, at_ns: int, health: Health | None = None) -> None:
        """Count a message.  health: the message, when it is one."""
        self._pass(at_ns)
        place = self._places.get(key) or self._place(key)
        if place is not None:
            service, topic = place
            sender = self.senders[service]
            if health is not None:
                self._report(service, sender, health, at_ns)
            sender.seen[topic] = sender.seen.get(topic, 0) + 1

    def _pass(self, at_ns: int) -> None:
        """Note the time of an event."""
        if at_ns >= self.end_ns - STEP_NS:
            self.end_ns = max(self.end_ns, at_ns)
            return
        if len(self.steps) < MAX_STEPS:
            self.steps.append((self.end_ns + HEALTH_NS, at_ns - HEALTH_NS))
        self.end_ns = at_ns

    def lines(self) -> dict[tuple[ServiceKey, str], Line]:
        """By service and name of the topic; of services that report what they send."""
        return {
            (service, topic): line
            for service, sender in sorted(self.senders.items())
            for topic, line in self._lines(sender).items()
        }

    def metadata(self) -> dict[str, str]:
        """The account as metadata of a take."""
        text = {" ".join(service): msgspec.json.encode(sender).decode() for service, sender in self.senders.items()}
        numbers = {"dropped": str(self.dropped), "end_ns": str(self.end_ns)}
        return {**text, **numbers, "steps": msgspec.json.encode(self.steps).decode()}

    def _place(self, key: str) -> tuple[ServiceKey, str] | None:
        topic = topic_at(key)
        service = sender_of(topic, key) if topic is not None else None
        known = service in self.senders or service in self.own
        if topic is None or service is None or not (known or len(self.senders) < MAX_SERVICES + len(self.own)):
            return None
        self.senders.setdefault(service, Sender({}, {}))
        place = self._places[key] = service, topic.name
        return place

    def _report(self, service: ServiceKey, sender: Sender, health: Health, at_ns: int) -> None:
        """Note what a health says; it is not counted itself yet."""
        process = health.counts.get(PROCESS)
        if process is None or abs(at_ns - (health.captured_ns - health.clock_offset_ns)) > FRESH_NS:
            return
        sent = {COUNTED[name]: count for name, count in health.counts.items() if name in COUNTED}
        seen, ended = dict(sender.seen), bool(health.counts.get(ENDED))
        if ended:  # then it counts itself
            sent, seen = (summed((counts, {HEALTH.name: 1})) for counts in (sent, seen))
        report = Report(at_ns, len(self.steps), sent, seen, ended)
        life = sender.lives.get(process)
        if life is not None:
            before = sum(missing_of(life).values())
            life.last = report
            if at_ns > life.gone_ns:  # else it waited in the queue when the token went
                life.gone_ns = 0
            self.missing += sum(missing_of(life).values()) - before
        elif (len(sender.lives) if service in self.own else self._others) < MAX_LIVES:
            self._others += service not in self.own
            previous = next(reversed(sender.lives.values()), None)
            life = sender.lives[process] = Life(report, report)
            if previous is None:
                life.unlogged = less(sent, seen)
            elif previous.last.ended:
                life.missing = less(sent, less(seen, previous.last.seen))
                self.missing += sum(life.missing.values())

    def _lines(self, sender: Sender) -> dict[str, Line]:
        lives = list(sender.lives.values())
        unknown = tuple(span for number in range(len(lives)) for span in self._unknown(lives, number))
        missing, unlogged = summed(map(missing_of, lives)), summed(life.unlogged for life in lives)
        topics = sorted({HEALTH.name, *sender.seen, *missing, *unlogged}) if lives else []
        lines = {}
        for topic in topics:
            seen, lost, off = (counts.get(topic, 0) for counts in (sender.seen, missing, unlogged))
            lines[topic] = Line(seen + lost + off, seen, lost, off, unknown)
        return lines

    def _unknown(self, lives: list[Life], number: int) -> list[Span]:
        """Times of which the counts of a process say nothing: after its last report, unless it ended with that."""
        life = lives[number]
        if life.unknown is not None:
            return life.unknown
        if life.last.ended:
            return []
        return self.spans(life.last, lives[number + 1].first if number + 1 < len(lives) else self.end_of(life))

    def end_of(self, life: Life) -> Report:
        """The end of the last process of a service, as a report without counts."""
        return Report(life.gone_ns or self.end_ns, len(self.steps), {}, {})

    def spans(self, begin: Report, end: Report) -> list[Span]:
        """The time between two reports, divided where the clock was set back."""
        steps = self.steps[begin.step : end.step]
        begins, ends = [begin.at_ns, *(after for _, after in steps)], [*(before for before, _ in steps), end.at_ns]
        return [(begin_ns, max(begin_ns, end_ns)) for begin_ns, end_ns in zip(begins, ends, strict=True)]


def read_account(metadata: Mapping[str, str]) -> Account | None:
    """The account in the metadata of a take; None without one that can be read."""
    senders = {}
    try:
        for name, text in metadata.items():
            service, space, id = name.partition(" ")
            if space and " " not in id:
                senders[service, id] = msgspec.json.decode(text, type=Sender)
        steps = msgspec.json.decode(metadata["steps"], type=list[Span])
        end_ns = msgspec.json.decode(metadata["end_ns"], type=Nanoseconds)
        return Account(senders, end_ns, steps, int(metadata["dropped"]))
    except (KeyError, ValueError, msgspec.MsgspecError):
        return None


def sender_of(topic: Topic, key: str) -> ServiceKey | None:
    """The service that counts a message with this key as sent; None when none does."""
    return None if topic.queueing is Queueing.LATCHED else service_at(key)


def missing_of(life: Life) -> Counts:
    """Messages of a process that were not seen although a log was on."""
    sent, seen = less(life.last.sent, life.first.sent), less(life.last.seen, life.first.seen)
    return summed((life.missing, less(less(sent, life.off), seen)))


def less(counts: Counts, others: Counts) -> Counts:
    """The differences that are positive."""
    return {name: count - others.get(name, 0) for name, count in counts.items() if count > others.get(name, 0)}


def summed(all: Iterable[Counts]) -> Counts:
    total: Counts = {}
    for counts in all:
        for name, count in counts.items():
            total[name] = total.get(name, 0) + count
    return total
