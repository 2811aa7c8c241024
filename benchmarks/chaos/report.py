"""The report of a run as text."""

from collections import defaultdict
from statistics import median

from benchmarks.chaos.invariants import SETTLED_NS
from benchmarks.chaos.outcome import Outcome
from benchmarks.table import Cell, table


def as_text(outcome: Outcome) -> str:
    """Faults by kind with their recoveries, processes, losses, violations."""
    by_kind: defaultdict[str, list[float]] = defaultdict(list)
    views: defaultdict[str, list[float]] = defaultdict(list)
    counts: defaultdict[str, int] = defaultdict(int)
    for recovery in outcome.recoveries:
        for fault in recovery.round.faults:
            counts[fault.kind] += 1
            by_kind[fault.kind].append(recovery.poses_s if recovery.poses_s is not None else float("inf"))
            views[fault.kind].append(recovery.views_s if recovery.views_s is not None else float("inf"))
    rows: list[list[Cell]] = [
        [kind, counts[kind], median(by_kind[kind]), max(by_kind[kind]), median(views[kind]), max(views[kind])]
        for kind in sorted(counts)
    ]
    columns = ["fault", "number", "poses back, median s", "worst s", "all views, median s", "worst s"]
    poses = [r.poses_s if r.poses_s is not None else float("inf") for r in outcome.recoveries] or [0.0]
    loads = [recovery.load for recovery in outcome.recoveries] or [0.0]
    lines = [
        table(f"Chaos, seed {outcome.seed}, {outcome.seconds:.0f} s", columns, rows),
        f"rounds: {len(outcome.recoveries)}; poses back: median {median(poses):.1f} s, worst {max(poses):.1f} s; "
        f"load of the machine: {min(loads):.1f} to {max(loads):.1f}",
        f"poses seen: {len(outcome.poses)}; takes: {len(outcome.takes)}, of them finished: "
        f"{sum(take.whole for take in outcome.takes)}; messages in them: {sum(take.messages for take in outcome.takes)}",
        f"log: {outcome.log_bytes / 1000:.0f} kB; largest process: {_largest(outcome)}",
        f"memory after the start, at most, at the end (MB): {_memory(outcome)}",
        f"`zenocap up`: {outcome.summary}",
        *(f"note: {note}" for note in outcome.notes),
        *(f"violation: {text}" for text in outcome.violations),
        f"violations: {len(outcome.violations)}",
    ]
    return "\n".join(lines)


def _memory(outcome: Outcome) -> str:
    """Of the last process of every service: after SETTLED_NS, at most, at the end."""
    found = {}
    for seen in outcome.processes:
        settled = [rss / 1e6 for time_ns, rss in seen.rss_bytes if time_ns - seen.first_ns >= SETTLED_NS]
        if settled:
            found[seen.name] = f"{seen.name} {settled[0]:.0f}, {max(settled):.0f}, {settled[-1]:.0f}"
    return "; ".join(found[name] for name in sorted(found))


def _largest(outcome: Outcome) -> str:
    sizes = [(rss, seen.name) for seen in outcome.processes for _, rss in seen.rss_bytes]
    files = [(count, seen.name) for seen in outcome.processes for _, count in seen.files]
    if not sizes:
        return "none"
    return f"{max(sizes)[1]}, {max(sizes)[0] / 1e6:.0f} MB; most open files: {max(files)[1]}, {max(files)[0]}"
