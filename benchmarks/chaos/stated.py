"""Statement of `zenocap up` against the takes and what an observer has received, per topic."""

import re
from collections.abc import Mapping, Sequence

from benchmarks.chaos.injection import STEP_S
from benchmarks.chaos.observer import Place, SeenFrame
from benchmarks.chaos.takes import Content, Span, in_takes, unrecorded, within

SUM = re.compile(
    r"^messages: (\d+) sent = (\d+) in the takes \+ (\d+) dropped by the queue of the log \+ (\d+) never arrived at a log "
    r"\+ (\d+) refused by the writer \+ (\d+) sent while no take was written$", re.MULTILINE,
)  # fmt: skip
ALL_LOST = re.compile(r"^takes: (\d+) lost", re.MULTILINE)  # of several takes
ONE_LOST = re.compile(r"^take: .*\.mcap: \d+ messages, (\d+) lost", re.MULTILINE)
TAKE = re.compile(r"^take: (.*\.mcap): (\d+) messages", re.MULTILINE)
TOPIC = re.compile(r"^  (\w+) of (.*): (\d+) sent, (\d+) of them lost$", re.MULTILINE)
UNKNOWN = re.compile(r"^not counted: what (.*) sent from ([\d:.]+) UTC to ([\d:.]+) UTC", re.MULTILINE)
MORE_TOPICS = re.compile(r"^  \w+ of .* of them lost\n  and more$", re.MULTILINE)
MORE_TIMES = re.compile(UNKNOWN.pattern + r".*\n  and more$", re.MULTILINE)
DAY_S, MARGIN_S = 86400.0, 0.2  # a time is stated to 0.1 s, and received a little later


def wrong_statement(
    text: str, status: int | None, takes: Sequence[Content], seen: Mapping[Place, Sequence[SeenFrame]],
    clock: Sequence[Span] = (),
) -> list[str]:  # fmt: skip
    """Contradictions of the statement with the takes and the observer's messages.

    text, status: of `up`.  takes, seen: all of the run, also deleted ones.  clock: times of steps.
    """
    if (found := SUM.search(text)) is None:
        return [f"statement: none on the messages; {text[-1000:]}"]
    sent, stored, *lost_by_cause, unlogged = map(int, found.groups())
    lost, whole = sum(lost_by_cause), ALL_LOST.findall(text) or ONE_LOST.findall(text)
    topics = {(topic, of): int(count) for topic, of, _, count in TOPIC.findall(text)}
    named = dict(TAKE.findall(text))
    its = [take for take in takes if str(take.path) in named]
    more, counted, of_topics = bool(MORE_TOPICS.search(text)), sum(take.counted for take in its), sum(topics.values())
    checks = {
        f"{sent} sent are not {stored} + {lost} + {unlogged}": sent != stored + lost + unlogged,
        f"{', '.join(whole)} lost are not {lost}": whole != [str(lost)],
        f"topics have lost {of_topics}, all {lost}": of_topics > lost or (of_topics < lost and not more),
        f"{stored} in the takes, which have {counted}": stored < counted
        or (stored > counted and all(t.whole for t in its)),
        f"status {status} with {lost} lost, {len(UNKNOWN.findall(text))} times not counted": (
            status == 0 and bool(lost or UNKNOWN.search(text) or "; cut: " in text)
        ),
    }
    checks |= {
        f"{take.path.name}: {named[str(take.path)]} messages stated, {take.messages} read": True
        for take in its
        if take.whole and int(named[str(take.path)]) != take.messages
    }
    for place, messages in seen.items():
        its_lost, forged = lost if more else topics.get(place, 0), sum(take.forged[place] for take in takes)
        silent = _silent(unrecorded(messages, takes, [place]), text, place[1], clock)
        missing, of = in_takes(silent, takes, clock), " of ".join(place)
        checks |= {
            f"{len(silent)} {of} are in no take, {its_lost} are stated as lost, {unlogged} as sent without a take": (
                len(silent) > its_lost + unlogged + forged  # which hide as many losses
            ),
            f"{len(missing)} {of} of the times of takes are in none, {its_lost} are lost": len(missing) > its_lost + forged,
        }
    return [f"statement: {what}" for what, is_wrong in checks.items() if is_wrong]


def _silent(seen: Sequence[SeenFrame], text: str, service: str, clock: Sequence[Span]) -> list[SeenFrame]:
    """Messages of a service without those of times of which the statement names that they are not counted."""
    unknown = [(_of_day_s(begin), _of_day_s(end)) for of, begin, end in UNKNOWN.findall(text) if of == service]
    return [] if MORE_TIMES.search(text) else [
        one for one in seen
        if not _is_within(one.received_ns, unknown, MARGIN_S + STEP_S[1] * within(one.received_ns, clock))
    ]  # fmt: skip


def _of_day_s(clock: str) -> float:
    hours, minutes, seconds = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)


def _is_within(time_ns: int, spans: Sequence[tuple[float, float]], margin_s: float) -> bool:
    at_s = time_ns / 1e9 % DAY_S
    return any((at_s - begin + margin_s) % DAY_S <= (end - begin) % DAY_S + 2 * margin_s for begin, end in spans)
