"""Closing statement on a rig's messages: sent = in the takes + lost by cause + unlogged."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from zenocap.common.messages import SENT
from zenocap.common.observe.account import Account, Line, Span
from zenocap.common.observe.several_logs import began, completed, joined
from zenocap.common.observe.view import RigView
from zenocap.common.recording.take_account import Place, TakeAccount, readable
from zenocap.common.rig.services import MAIN, TIMEKEEPER, ServiceKey, title
from zenocap.common.topics import Topic

MOST_LINES = 20  # of topics with losses, and of spans


@dataclass(frozen=True)
class Statement:
    """lines: of the topics of each service.  refused: messages that a log received and that are in no take.

    dropped: events that the full queue of a log dropped; the messages among them are missing.
    """

    lines: Mapping[Place, Line]
    refused: Mapping[Place, int]
    dropped: int = 0

    @property
    def sent(self) -> int:
        return sum(line.sent for line in self.lines.values())

    @property
    def terms(self) -> dict[str, int]:
        """Parts of `sent`, by what became of the messages; their sum is `sent`."""
        seen, missing, unlogged = (
            sum(getattr(line, kind) for line in self.lines.values()) for kind in ("seen", "missing", "unlogged")
        )
        refused, dropped = sum(self.refused.values()), min(self.dropped, missing)
        return {
            "in the takes": seen - refused,
            "dropped by the queue of the log": dropped,
            "never arrived at a log": missing - dropped,
            "refused by the writer": refused,
            "sent while no take was written": unlogged,
        }

    @property
    def lost(self) -> int:
        """Messages that are in no take although one was to be written."""
        return sum(line.missing for line in self.lines.values()) + sum(self.refused.values())

    @property
    def unknown(self) -> dict[ServiceKey, tuple[Span, ...]]:
        """Log times without a count, by service."""
        return {service: line.unknown for (service, _), line in self.lines.items() if line.unknown}

    @property
    def complete(self) -> bool:
        return not (self.lost or self.unknown)

    def text(self) -> Iterator[str]:
        """Lines for display; none when no service reported what it sends."""
        if not self.lines:
            return
        yield f"messages: {self.sent} sent = {_added(self.terms)}"
        yield from _shortened(
            f"  {topic} of {title(service)}: {line.sent} sent, {lost} of them lost"
            for (service, topic), line in self.lines.items()
            if (lost := line.missing + self.refused.get((service, topic), 0))
        )
        yield from _shortened(
            f"not counted: what {title(service)} sent from {_clock(begin)} to {_clock(end)}, after its last report"
            for service, spans in self.unknown.items()
            for begin, end in spans
        )


def statement(
    takes: Sequence[TakeAccount], reports: Account, services: Collection[ServiceKey], *, whole: bool = True
) -> Statement:
    """Statement on the messages of some services.

    takes: of the run, in order.  reports: account of the healths that were received beside the logs.
    whole: whether each log finished its files, and none was removed.
    """
    account, before = Account(), None
    for take in takes:  # a later part continues the take, also when the file before it was removed
        continued = bool(take.previous) or (before is not None and not before.complete)
        account, before = joined(account, take.account, continued=continued), take
    account = completed(account, reports, continued=not whole)
    lines = {place: line for place, line in account.lines().items() if place[0] in services}
    refused = {place: sum(take.refused[place] for take in takes) for place in lines}
    return Statement(lines, {place: count for place, count in refused.items() if count}, account.dropped)


def frame_lines(view: RigView, topic: Topic) -> Iterator[str]:
    """What became of the frames of all viewers.  topic: of the message that a viewer sends with every frame."""
    viewers = [one for (service, _), one in view.services.items() if service == "viewer"]

    def total(name: str) -> int:
        return sum(one.total(name) for one in viewers)

    processed = total("frames")
    terms = {"processed": processed, "failed": total("failed_frames"), "dropped": total("dropped_frames")}
    terms["skipped under overload"] = total("skipped_frames")
    uses = {"sent": total(SENT + topic.name), "for the background": total("learning_frames")}
    uses["not sendable"] = total("unsendable")
    if captured := sum(terms.values()):
        yield f"frames: {captured} captured = {_added(terms)}; {processed} processed = {_added(uses)}"


def _added(terms: Mapping[str, int]) -> str:
    return " + ".join(f"{count} {name}" for name, count in terms.items())


def new_takes(folder: Path, known: Collection[Path], rig: str, reports: Account) -> tuple[list[TakeAccount], list[str]]:
    """Takes of a rig in `folder` besides the known ones, in order; and why others cannot be read.

    reports: see `statement`.
    """
    found = [readable(path) for path in sorted(set(folder.glob("*.mcap")) - set(known))]
    takes = [one for one in found if isinstance(one, TakeAccount) and one.rig == rig]
    order = {take.path: began(take.account, reports, (TIMEKEEPER, MAIN)) for take in takes}
    takes.sort(key=lambda take: take.start_ns if None in order.values() else order[take.path] or ())
    return takes, [one for one in found if isinstance(one, str)]


def _shortened(lines: Iterator[str]) -> Iterator[str]:
    for number, line in enumerate(lines):
        if number == MOST_LINES:
            yield "  and more"
            return
        yield line


def _clock(time_ns: int) -> str:
    return f"{datetime.fromtimestamp(time_ns // 10**9, UTC):%H:%M:%S}.{time_ns // 10**8 % 10} UTC"
