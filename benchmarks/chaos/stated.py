"""Statement of `zenocap up` against the takes and the poses of an observer."""

import re
from collections.abc import Sequence

from benchmarks.chaos.injection import STEP_S
from benchmarks.chaos.observer import SeenPose
from benchmarks.chaos.takes import Content, Span, missing_poses, within

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
    text: str, status: int | None, takes: Sequence[Content], poses: Sequence[SeenPose], service: str = "tracker",
    clock: Sequence[Span] = (),
) -> list[str]:  # fmt: skip
    """Contradictions of the statement with the takes and the observer's poses.

    text, status: of `up`.  takes, poses: all of the run, also deleted ones.  service: of the poses.  clock: times of steps.
    """
    if (found := SUM.search(text)) is None:
        return [f"statement: none on the messages; {text[-1000:]}"]
    sent, stored, *lost_by_cause, unlogged = map(int, found.groups())
    lost, whole = sum(lost_by_cause), ALL_LOST.findall(text) or ONE_LOST.findall(text)
    topics = [(of, int(count)) for _, of, _, count in TOPIC.findall(text)]
    unknown = [(_of_day_s(begin), _of_day_s(end)) for of, begin, end in UNKNOWN.findall(text) if of == service]
    named = dict(TAKE.findall(text))
    its = [take for take in takes if str(take.path) in named]
    recorded = set().union(*(take.poses for take in takes))
    silent = [] if MORE_TIMES.search(text) else [
        pose for pose in poses
        if (pose.captured_ns, pose.frame % 2**32) not in recorded
        and not _is_within(pose.received_ns, unknown, MARGIN_S + STEP_S[1] * within(pose.received_ns, clock))
    ]  # fmt: skip
    missing, more = missing_poses(silent, takes, clock), bool(MORE_TOPICS.search(text))
    counted, of_topics = sum(take.counted for take in its), sum(count for _, count in topics)
    pose_lost = lost if more else sum(count for of, count in topics if of == service)
    checks = {
        f"{sent} sent are not {stored} + {lost} + {unlogged}": sent != stored + lost + unlogged,
        f"{', '.join(whole)} lost are not {lost}": whole != [str(lost)],
        f"topics have lost {of_topics}, all {lost}": of_topics > lost or (of_topics < lost and not more),
        f"{stored} in the takes, which have {counted}": stored < counted
        or (stored > counted and all(t.whole for t in its)),
        f"{len(silent)} poses are in no take, {pose_lost} are stated as lost, {unlogged} as sent without a take": (
            len(silent) > pose_lost + unlogged
        ),
        f"{len(missing)} poses of the times of takes are in none, {pose_lost} are lost": len(missing) > pose_lost,
        f"status {status} with {lost} lost, {len(UNKNOWN.findall(text))} times not counted": (
            status == 0 and bool(lost or UNKNOWN.search(text) or "; cut: " in text)
        ),
    }
    checks |= {
        f"{take.path.name}: {named[str(take.path)]} messages stated, {take.messages} read": True
        for take in its
        if take.whole and int(named[str(take.path)]) != take.messages
    }
    return [f"statement: {what}" for what, is_wrong in checks.items() if is_wrong]


def _of_day_s(clock: str) -> float:
    hours, minutes, seconds = clock.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)


def _is_within(time_ns: int, spans: Sequence[tuple[float, float]], margin_s: float) -> bool:
    at_s = time_ns / 1e9 % DAY_S
    return any((at_s - begin + margin_s) % DAY_S <= (end - begin) % DAY_S + 2 * margin_s for begin, end in spans)
