"""One account of several logs in order, and of the healths that were received beside them.

The laws, for each topic of a service.  A place is a report of which it is known what the logs had seen before it: one has
it, or none was on.
1. Between two places, what was sent and not seen is absent: exactly, unless a process ended between them without a last
   report.
2. If one did, at least as much is absent, and the time between both places is unknown.
3. What is absent is missing if it was to be recorded, else unlogged.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from msgspec import structs

from zenocap.common.observe.account import MAX_SERVICES, Account, Counts, Life, Report, Sender, less, missing_of, summed
from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import HEALTH


class OneLog(NamedTuple):
    """A log.  begin_ns: log time of its first message.  own, all: account of it, and of it and those before."""

    begin_ns: int
    own: Account
    all: Account


class _Place(NamedTuple):
    """since, until: reports between which it lies.  sent: by all processes of the service before.  seen: by all logs.

    is_sure: whether all processes that have ended since the place before sent a last report.
    """

    since: Report
    until: Report
    sent: Counts
    seen: Counts
    is_sure: bool


def joined(before: Account, after: Account, *, continued: bool) -> Account:
    """Account of a log and of a later one.  continued: what was sent between both is missing, not unlogged."""
    senders = dict(before.senders)
    for service, sender in after.senders.items():
        one = senders.get(service, Sender())
        senders[service] = _joined(one, _moved(sender, one.seen, len(before.steps)), continued=continued)
    end_ns = after.end_ns or before.end_ns
    return Account(senders, end_ns, [*before.steps, *after.steps], before.dropped + after.dropped, after.own)


def ended(account: Account) -> Account:
    """An account that a later log may continue: of each service the last report alone."""
    senders = {}
    kept = sorted(account.senders.items(), key=lambda one: one[0] not in account.own)[: MAX_SERVICES + len(account.own)]
    for service, sender in kept:
        process, life = next(reversed(sender.lives.items()), (0, None))
        senders[service] = Sender(sender.seen, {} if life is None else {process: Life(life.last, life.last)})
    return Account(senders, account.end_ns, account.steps, own=account.own)


def completed(logs: Sequence[OneLog], reports: Account, *, continued: bool, between: bool = False) -> Account:
    """Account of logs, and of what healths say that were received beside them.

    reports: of them alone.  continued: what was sent after the last log is missing, not unlogged.
    between: the same of what was sent before it by processes that it has not.
    """
    all = logs[-1].all if logs else Account()
    senders = {
        service: _completed(service, sender.lives, logs, reports, (continued or between, continued))
        for service, sender in reports.senders.items()
    }
    return Account(all.senders | senders, all.end_ns, all.steps, all.dropped)


def _joined(before: Sender, after: Sender, *, continued: bool) -> Sender:
    """A service of two logs.  after: its counts of seen messages begin with those of `before`."""
    lives = dict(before.lives)
    last = next((life.last for life in reversed(lives.values())), None)
    # Seen before and without a report since: sent by the next process, unless the one before it had not ended.
    loose = before.seen if last is None else less(before.seen, last.seen) if last.ended else {}
    for process, life in after.lives.items():
        one = lives.get(process)
        if one is None:
            between = less(life.unlogged, loose)
            missing, unlogged = ((life.missing, between), ()) if continued else ((life.missing,), (between,))
            lives[process] = structs.replace(life, missing=summed(missing), unlogged=summed(unlogged))
            continue
        # Else it is missing between the first and the last report.
        off = {} if continued else less(less(life.first.sent, one.last.sent), less(life.first.seen, one.last.seen))
        lives[process] = structs.replace(
            life, first=one.first, missing=summed((one.missing, life.missing)), unlogged=summed((one.unlogged, off)),
            off=summed((one.off, off)),
        )  # fmt: skip
    return Sender(after.seen, lives)


def _moved(sender: Sender, seen: Counts, steps: int) -> Sender:
    """A service with counts of seen messages, and of steps of the clock, that began earlier."""

    def moved(report: Report) -> Report:
        return structs.replace(report, step=report.step + steps, seen=summed((seen, report.seen)))

    lives = {
        process: structs.replace(life, first=moved(life.first), last=moved(life.last))
        for process, life in sender.lives.items()
    }
    return Sender(summed((seen, sender.seen)), lives)


def _completed(
    service: ServiceKey, lives: Mapping[int, Life], logs: Sequence[OneLog], reports: Account, continued: tuple[bool, bool]
) -> Sender:
    """A service of logs, with what an account of healths knows of its processes.

    continued: of processes before those in the last log, and from them on.
    """
    logged = logs[-1].all.senders.get(service, Sender()) if logs else Sender()
    in_logs = [log.own.senders.get(service, Sender()).lives.keys() for log in logs]
    lives = {**lives, **{process: life for process, life in logged.lives.items() if process not in lives}}
    if not lives:
        return logged
    dated = None if reports.steps or any(log.own.steps for log in logs) else logs  # None: no time tells if a log was on
    absent, unknown = _absent(_places(service, lives, logged, dated if logs else (), reports), reports)
    unlogged, lost = _outside(lives, logged, in_logs, dated or (), continued)
    missing = summed(map(missing_of, logged.lives.values()))
    missing = (Counter(missing) | Counter(less(absent, unlogged))) & Counter(summed((missing, lost))) & Counter(absent)
    end = next(reversed(lives.values())).last
    return Sender(logged.seen, {0: Life(end, end, missing, less(absent, missing), unknown=unknown)})


def _outside(
    lives: Mapping[int, Life], logged: Sender, in_logs: Sequence[Collection[int]], logs: Sequence[OneLog],
    continued: tuple[bool, bool],
) -> tuple[Counts, Counts]:  # fmt: skip
    """Messages of a service, at most, that were not to be recorded, and those outside the logs that were."""
    unlogged, lost = summed(one.unlogged for one in logged.lives.values()), Counts()
    last = next(reversed(logged.lives), None)
    seen = {} if logged.lives else logged.seen  # after its last report, of it and of later processes
    is_after = is_on = False  # whether it is in the last log or later; whether its log has a later one too
    for process, life in lives.items():
        one = logged.lives.get(process)
        is_after |= process in next(reversed(in_logs), ())
        if one is not None:
            lost = summed((lost, one.first.sent if is_on else {}))
            is_on = any(process in its and process != [*its][-1] for its in in_logs)
            seen = less(logged.seen, one.last.seen) if process == last else seen
        rest = less(_sent(life), {} if one is None else one.last.sent)
        was_on = is_on or any(log.begin_ns < life.last.at_ns <= log.own.end_ns for log in logs)
        # What it sent after the report with which it ended in a log, it sent after that: of an integrator the last health.
        if was_on or (continued[is_after] and not (one is not None and one.last.ended)):
            lost = summed((lost, rest))
        else:
            unlogged = summed((unlogged, less(rest, seen)))
        seen = less(seen, rest)
    return unlogged, lost


def _absent(places: Iterator[_Place], reports: Account) -> tuple[Counts, list[tuple[int, int]]]:
    """Messages of a service that no log has, and the unknown times."""

    def between(one: _Place, other: _Place) -> Counts:
        return less(less(other.sent, one.sent), less(other.seen, one.seen))

    absent, unknown = Counts(), list[tuple[int, int]]()
    begin = before = next(places)
    for place in places:
        if not place.is_sure:
            absent = summed((absent, between(begin, before), between(before, place)))
            unknown += reports.spans(before.since, place.until)
            begin = place
        before = place
    return summed((absent, between(begin, before))), unknown


def _places(
    service: ServiceKey, lives: Mapping[int, Life], logged: Sender, logs: Sequence[OneLog] | None, reports: Account
) -> Iterator[_Place]:
    """The places of a service, from its first report to the end of all.  logs: None where no time tells of them."""
    first = next(iter(lives.values())).first
    yield _Place(first, first, {}, {}, is_sure=True)
    sent, is_sure = Counts(), True
    for process, life in lives.items():
        one = logged.lives.get(process)
        in_logs = {} if one is None else {_number(report): report for report in (one.first, one.last)}
        of_both = {**in_logs, _number(life.first): life.first, _number(life.last): life.last}
        for number, report in sorted(of_both.items()):
            if number in in_logs:
                seen: Counts | None = in_logs[number].seen
            else:
                seen = None if logs is None else _seen_at(report.at_ns, service, logs)
            if seen is not None:
                is_placed = logs is not None or report is not in_logs.get(number)
                since, until = (report, report) if is_placed else (life.first, life.last)
                yield _Place(since, until, summed((sent, report.sent)), seen, is_sure)
                is_sure = True
        sent = summed((sent, _sent(life)))
        is_sure &= life.last.ended
    end = reports.end_of(life)
    yield _Place(end, end, sent, logged.seen, is_sure)


def _sent(life: Life) -> Counts:
    """What a process has sent, as far as it is known: with its last report."""
    return life.last.sent if life.last.ended else summed((life.last.sent, {HEALTH.name: 1}))


def _number(report: Report) -> int:
    """Number of a report among those of its process."""
    return report.sent.get(HEALTH.name, 0)


def _seen_at(at_ns: int, service: ServiceKey, logs: Sequence[OneLog]) -> Counts | None:
    """What logs had seen of a service when none was on; None where one was that has seen something of it."""
    seen = Counts()
    for log in logs:
        if log.own.senders.get(service, Sender()).seen:
            if log.begin_ns < at_ns <= log.own.end_ns:
                return None
            if log.own.end_ns < at_ns:
                seen = log.all.senders[service].seen
    return seen
