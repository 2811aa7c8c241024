"""Closing statement on a rig's messages: sent = in the takes + lost by cause + unlogged.

The laws are in `common/observe/several_logs`.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import MappingProxyType

from msgspec import structs

from zenocap.common.observe.account import Account, Line, Span
from zenocap.common.observe.several_logs import OneLog, completed, joined
from zenocap.common.recording.take_account import Place, TakeAccount
from zenocap.common.rig.services import ServiceKey, title
from zenocap.tools.record.launcher.run_takes import ended_with_its_integrator, next_process

MOST_LINES = 20  # of topics with losses, and of spans


@dataclass(frozen=True)
class TakeShare:
    """One take of a run.  lost: messages that its log was to have and that it has not.

    gap: log times of the end of the one before and of its beginning, when the integrator has ended between them; else None.
    lost_before: messages between both that were to be in a take.
    """

    take: TakeAccount
    lost: int
    gap: Span | None = None
    lost_before: int = 0


@dataclass(frozen=True)
class Statement:
    """lines: of the topics of each service.  refused: messages that a log received and that are in no take.

    dropped: events that the full queue of a log dropped; the messages among them are missing.  takes: in order.
    """

    lines: Mapping[Place, Line]
    refused: Mapping[Place, int]
    dropped: int = 0
    takes: tuple[TakeShare, ...] = ()

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
    def lost_outside(self) -> int:
        """Those of `lost` that were sent after the last take, or by a process that is in none."""
        return max(0, self.lost - sum(one.lost + one.lost_before for one in self.takes))

    @property
    def unknown(self) -> dict[ServiceKey, tuple[Span, ...]]:
        """Log times without a count, by service."""
        return {service: line.unknown for (service, _), line in self.lines.items() if line.unknown}

    @property
    def complete(self) -> bool:
        return not (self.lost or self.unknown)

    def take_text(self) -> Iterator[str]:
        """Lines on the takes for display: each with its own loss, the gaps between them, and the whole loss."""
        whole, several = self._loss(), len(self.takes) != 1
        before = ""
        for one in self.takes:
            name = one.take.path.name
            if one.gap is not None:
                begin, end = one.gap
                yield (
                    f"take: none from {_clock(begin)} to {_clock(end)}, between {before} and {name}: "
                    f"the integrator was started again, {one.lost_before} lost"
                )
            elif one.lost_before:
                yield f"take: between {before} and {name}: {one.lost_before} lost"
            cut = "" if one.take.complete else "; cut: its integrator did not close it"
            yield f"take: {one.take.path}: {one.take.messages} messages, {f'{one.lost} lost' if several else whole}{cut}"
            before = name
        if several:
            rest = f"; {self.lost_outside} of them outside these takes and gaps" if self.takes and self.lost_outside else ""
            yield f"takes: {whole}{rest}"

    def _loss(self) -> str:
        """What is lost as text."""
        if not self.lines and any(not one.take.complete for one in self.takes):
            return "an unknown number lost: see the integrator's output"
        unknown_ns = sum(end - begin for spans in self.unknown.values() for begin, end in spans)
        return f"{self.lost} lost{f', and an unknown number in {unknown_ns / 1e9:.1f} s' if self.unknown else ''}"

    def text(self) -> Iterator[str]:
        """Lines for display; none when no service reported what it sends."""
        if not self.lines:
            return
        yield f"messages: {self.sent} sent = {added(self.terms)}"
        yield from _shortened(
            f"  {topic} of {title(service)}: {line.sent} sent, {lost} of them lost"
            for (service, topic), line in self.lines.items()
            if (lost := line.missing + self.refused.get((service, topic), 0))
        )
        yield from unknown_lines("sent", self.unknown)


def statement(
    takes: Sequence[TakeAccount], reports: Account, services: Collection[ServiceKey], *, whole: bool = True,
    unresumed: Mapping[int, Account] = MappingProxyType({}),
) -> Statement:  # fmt: skip
    """Statement on the messages of some services.

    takes: of the run, in order.  reports: account of the healths that were received beside the logs.
    whole: whether the last log finished its files, and none was removed.  unresumed: see `Unresumed`.
    """

    def missing(account: Account) -> int:
        return sum(line.missing for (service, _), line in account.lines().items() if service in services)

    account, logs, shares = Account(), list[OneLog](), list[TakeShare]()
    lost_before = Counter[Place]()  # after takes that were not resumed
    resumed, idle = True, Counter[Place]()
    for take in takes:  # a later part continues the take, also when the file before it was removed
        before = shares[-1].take if shares else None
        gap = None
        if before is not None and ended_with_its_integrator(before):
            end = None if resumed else next_process(before, reports)
            gap = (before.account.end_ns or before.start_ns, take.start_ns if end is None else end[1].first.at_ns)
        all = joined(account, take.account, continued=bool(take.previous) or (gap is not None and resumed))
        own = missing(take.account)
        refused = sum(count for (service, _), count in take.refused.items() if service in services)
        between = max(0, missing(all) - missing(account) - own) + sum(idle.values())
        shares.append(TakeShare(take, own + refused, gap, between))
        account = all
        logs.append(OneLog(take.start_ns, take.account, all))
        end = next_process(take, reports) if ended_with_its_integrator(take) else None
        resumed, idle = end is None or end[0] not in unresumed, Counter[Place]()
        if end is not None and not resumed:
            idle = _lost_until(logs, unresumed[end[0]], services)
            lost_before += idle
    gaps = any(one.gap is not None for one in shares)
    account = completed(logs, reports, continued=not whole and resumed, between=gaps and not lost_before)
    lines = {place: _with_lost(line, lost_before[place]) for place, line in account.lines().items() if place[0] in services}
    refusals = {place: sum(take.refused[place] for take in takes) for place in lines}
    found = Statement(lines, {place: count for place, count in refusals.items() if count}, account.dropped)
    return replace(found, takes=tuple(_within(shares, found.lost)))


def _within(shares: Sequence[TakeShare], lost: int) -> Iterator[TakeShare]:
    """The takes, with no more between them than is lost: what a killed process sent after its last health may be there."""
    lost -= sum(one.lost for one in shares)
    for one in shares:
        before = max(0, min(one.lost_before, lost))
        lost -= before
        yield replace(one, lost_before=before)


def _lost_until(logs: Sequence[OneLog], restarted: Account, services: Collection[ServiceKey]) -> Counter[Place]:
    """Messages that are not in the last take of an account and were sent before its integrator was started again."""
    before, found = logs[-1].all.lines(), completed(logs, restarted, continued=True, between=True).lines()
    return +Counter({
        place: line.missing - (before[place].missing if place in before else 0)
        for place, line in found.items() if place[0] in services
    })  # fmt: skip


def _with_lost(line: Line, count: int) -> Line:
    """The line with so many messages that were to be recorded, among those that were sent while no take was written."""
    count = min(count, line.unlogged)
    return structs.replace(line, missing=line.missing + count, unlogged=line.unlogged - count)


def unknown_lines(what: str, unknown: Mapping[ServiceKey, Sequence[Span]]) -> Iterator[str]:
    """Lines on times without a count.  what: services did then."""
    yield from _shortened(
        f"not counted: what {title(service)} {what} from {_clock(begin)} to {_clock(end)}, after its last report"
        for service, spans in unknown.items()
        for begin, end in spans
    )


def added(terms: Mapping[str, int]) -> str:
    return " + ".join(f"{count} {name}" for name, count in terms.items())


def _shortened(lines: Iterator[str]) -> Iterator[str]:
    for number, line in enumerate(lines):
        if number == MOST_LINES:
            yield "  and more"
            return
        yield line


def _clock(time_ns: int) -> str:
    return f"{datetime.fromtimestamp(time_ns // 10**9, UTC):%H:%M:%S}.{time_ns // 10**8 % 10} UTC"
