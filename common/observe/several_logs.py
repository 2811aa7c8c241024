"""One account of several logs in order, and of the healths that were received beside them."""

from msgspec import structs

from zenocap.common.observe.account import MAX_SERVICES, Account, Counts, Life, Report, Sender, less, summed
from zenocap.common.rig.services import ServiceKey
from zenocap.common.topics import HEALTH


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


def completed(
    logs: Account, reports: Account, *, continued: bool, last: Account | None = None, between: bool = False
) -> Account:
    """Account of logs, and of what healths say that were received beside them.

    reports: of them alone.  continued: what was sent after the last log is missing, not unlogged.  last: account of that
    log; between: the same of what was sent before it by processes that it has not.
    """
    senders = {
        service: _completed(
            logs.senders.get(service, Sender()), known, reports,
            Sender() if last is None else last.senders.get(service, Sender()), (continued or between, continued),
        )
        for service, known in reports.senders.items()
    }  # fmt: skip
    return Account(logs.senders | senders, logs.end_ns, logs.steps, logs.dropped)


def began(log: Account, reports: Account, service: ServiceKey) -> tuple[int, int] | None:
    """When a log began, for the order of several: number of the first process of a service in it, and of its healths.

    None where `reports` has not that process.  The time of a log gives no order: its clock may be set back.
    """
    first = next(iter(log.senders.get(service, Sender()).lives.items()), None)
    processes = list(reports.senders.get(service, Sender()).lives)
    if first is None or first[0] not in processes:
        return None
    return processes.index(first[0]), first[1].first.sent.get(HEALTH.name, 0)


def _joined(before: Sender, after: Sender, *, continued: bool) -> Sender:
    """A service of two logs.  after: its counts of seen messages begin with those of `before`."""
    lives = dict(before.lives)
    last = next(reversed(lives), None)
    if last is not None and after.lives and last not in after.lives:
        lives[last] = structs.replace(lives[last], tail=less(before.seen, lives[last].last.seen))
    # Seen before and without a report since: sent by the next process, unless the one before it had not ended.
    loose = before.seen if last is None else less(before.seen, lives[last].last.seen) if lives[last].last.ended else {}
    for process, life in after.lives.items():
        one = lives.get(process)
        if one is None:
            between = less(life.unlogged, loose)
            missing, unlogged = ((life.missing, between), ()) if continued else ((life.missing,), (between,))
            lives[process] = structs.replace(life, missing=summed(missing), unlogged=summed(unlogged))
            continue
        gap = less(less(life.first.sent, one.last.sent), less(life.first.seen, one.last.seen))
        if continued:
            gap = {}  # it is missing between the first and the last report
        first = structs.replace(one.first, sent=summed((one.first.sent, gap)))
        lives[process] = structs.replace(
            life, first=first, missing=summed((one.missing, life.missing)), unlogged=summed((one.unlogged, gap))
        )
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


def _completed(logged: Sender, known: Sender, reports: Account, at_last: Sender, continued: tuple[bool, bool]) -> Sender:
    """A service of logs, with what an account of healths knows of it.

    at_last: in the last log.  continued: of processes before those in it, and from them on.
    """
    lives, beside = dict(logged.lives), list(known.lives.values())
    last = next(reversed(lives), None)
    is_after = False
    seen = {} if lives else logged.seen  # after the last report of a process: of it, and of later ones without a report
    for number, (process, life) in enumerate(known.lives.items()):
        one = lives.get(process)
        is_after |= process in at_last.lives
        # What it sent after the report with which it ended in a log, it sent after that: of an integrator the last health.
        lost = continued[is_after] and not (one is not None and one.last.ended)
        if one is None:
            one = Life(life.first, life.first, unlogged={} if number else less(life.first.sent, seen))
            sent = less(life.last.sent, {} if number else life.first.sent)
        elif process == last or one.tail is not None:
            seen = less(logged.seen, one.last.seen) if process == last else one.tail or {}
            sent = less(life.last.sent, one.last.sent)
        else:  # another process followed in the same log: what was seen of either since the last report is not known
            continue
        more, seen = less(sent, seen), less(seen, sent)
        missing, unlogged = (more, {}) if lost else ({}, more)
        lives[process] = structs.replace(
            one, missing=summed((one.missing, missing)), unlogged=summed((one.unlogged, unlogged)),
            unknown=reports.unknown(beside, number),
        )  # fmt: skip
    return Sender(logged.seen, lives)
