"""The invariants of a run.  Each function returns lines on what is wrong; none when all is well."""

from collections.abc import Collection, Iterable, Sequence
from itertools import pairwise

from benchmarks.chaos.observer import SeenHealth
from benchmarks.chaos.running_rig import Seen
from benchmarks.chaos.takes import Span, within
from zenocap.common.messages import ENDED

LOG_BYTES_PER_MIN = 60_000  # of all services together: a line every 0.1 s
LOG_BYTES = 40_000  # besides: start, stop and the first error of each kind
SETTLED_NS = 15_000_000_000  # age of a process from which its memory counts: its kernels are loaded then
GROWTH_BYTES = 320 << 20  # two queues of 64 MB, which a flood may fill, and Zenoh's buffers of messages of 7 MB
MEMORY_BYTES = 1 << 30  # the limit of a container of deploy/compose.yaml
FILES = 512  # open at any time: 128 connections without a handshake, 64 pages, and what the service itself has
LEFT_OPEN = 40  # files more than after the start, when all faults are over
HEALTH_NS = 3_000_000_000  # a health message is this old at most when it shows an effect


def unexpected_ends(processes: Iterable[Seen], killed: Collection[int]) -> list[str]:
    """Services that ended although nobody killed them."""
    return [
        f"{seen.name} (pid {seen.pid}) ended by itself"
        for seen in processes
        if seen.ended_ns is not None and seen.pid not in killed
    ]


def large_processes(processes: Iterable[Seen]) -> list[str]:
    """Processes whose memory or open files grew beyond their bounds."""
    found = []
    for seen in processes:
        settled = [rss for time_ns, rss in seen.rss_bytes if time_ns - seen.first_ns >= SETTLED_NS]
        if settled:
            grown = max(settled) - settled[0]
            if grown > GROWTH_BYTES or max(settled) > MEMORY_BYTES:
                found.append(f"{seen.name}: memory from {settled[0] / 1e6:.0f} to {max(settled) / 1e6:.0f} MB")
        files = [(time_ns, count) for time_ns, count in seen.files if time_ns - seen.first_ns >= SETTLED_NS]
        if files and max(count for _, count in files) > FILES:
            found.append(f"{seen.name}: {max(count for _, count in files)} open files")
        if files and seen.ended_ns is None and files[-1][1] - files[0][1] > LEFT_OPEN:
            found.append(f"{seen.name}: {files[-1][1]} open files at the end, {files[0][1]} after the start")
    return found


def log_problems(text: str, size: int, seconds: float) -> list[str]:
    """Too much output, and tracebacks."""
    found = []
    if size > LOG_BYTES + LOG_BYTES_PER_MIN * seconds / 60:
        found.append(f"{size} bytes of log in {seconds:.0f} s")
    if tracebacks := text.count("Traceback (most recent call last)"):
        at = text.index("Traceback (most recent call last)")
        found.append(f"{tracebacks} tracebacks, the first: {text[at : at + 1500]}")
    return found


def obeyed_orders(health: Sequence[SeenHealth], spans: Sequence[Span], ordered_ns: Sequence[int]) -> list[str]:
    """Changes of the recording in `spans`, in which there were false orders only.  ordered_ns: times of the true ones."""
    found = []
    running = [one for one in health if one.service == "integrator" and not one.health.counts.get(ENDED)]
    states = [(one.received_ns, one.health.counts.get("log_on")) for one in running]
    for (earlier_ns, before), (later_ns, after) in pairwise(states):
        true_order = any(earlier_ns - HEALTH_NS <= time_ns <= later_ns for time_ns in ordered_ns)
        if before != after and within(later_ns, spans) and not true_order:
            found.append(f"the recording went from {before} to {after} by a false order")
    return found


def counted_losses(health: Sequence[SeenHealth], excused: Sequence[Span]) -> int:
    """Messages that the log has counted as lost at other than the excused times, at which many are."""
    states = [(one.received_ns, one.health.counts.get("log_lost", 0)) for one in health if one.service == "integrator"]
    steps = ((later_ns, after - before) for (_, before), (later_ns, after) in pairwise(states))
    return sum(max(0, step) for time_ns, step in steps if not within(time_ns, excused))


def too_many_takes(takes: int, records: int, starts: int, removals: int, output: str) -> list[str]:
    """Files that nobody ordered.  records: true orders to record.  starts: of integrators.  removals: of the recordings."""
    allowed = records + starts + removals
    return [f"{takes} takes of {allowed} ordered: {output}"] if takes > allowed else []
