"""Silent losses: poses that are in no take while the integrator records, and not counted as lost."""

from collections.abc import Sequence
from itertools import pairwise

from benchmarks.chaos.invariants import counted_losses
from benchmarks.chaos.observer import SeenHealth
from benchmarks.chaos.outcome import MARGIN_NS, PATIENCE_S, RunOutcome
from benchmarks.chaos.schedule import INTEGRATOR, ROUTER
from benchmarks.chaos.takes import Span, missing_poses, uncovered_poses, within


def losses(outcome: RunOutcome, health: Sequence[SeenHealth], deleted_ns: Sequence[int]) -> list[str]:
    """Poses that are in no take although one was written, beyond what was counted as lost at the same times.

    What Zenoh drops before a subscriber, on links that a flood of huge messages fills, is a note: the log counts it at the
    publisher's next health (`log_missing`), of which the last may not come.
    deleted_ns: times at which the takes were deleted.
    """
    excused = excused_times(outcome, deleted_ns)
    missing = missing_poses(outcome.poses, outcome.takes, excused)
    flooded = [pose for pose in missing if within(pose.received_ns, outcome.spans("huge"))]
    counted = counted_losses(health, excused)
    times = ", ".join(f"{outcome.run_s(pose.received_ns):.1f}" for pose in missing[:10])
    at = f" (at {times} s)" if missing else ""
    text = f"{len(missing)} poses are in no take{at}, {counted} messages counted as lost then"
    outcome.notes.append(f"{text}; {len(flooded)} of them during floods of huge messages, dropped by the network")
    found = [text] if len(missing) - len(flooded) > counted else []
    covered = [(take.first_ns, take.last_ns + MARGIN_NS) for take in outcome.takes]
    uncovered = uncovered_poses(outcome.poses, recorded_times(health), [*excused, *covered])
    if uncovered:
        at_s = outcome.run_s(uncovered[0].received_ns)
        found.append(f"{len(uncovered)} poses from {at_s:.1f} s on are in no take, although the integrator records")
    return found


def recorded_times(health: Sequence[SeenHealth]) -> list[Span]:
    """Times at which the integrator said that it records, without an error."""
    spans = []
    for one, after in pairwise(one for one in health if one.service == INTEGRATOR):
        counts = (one.health.counts, after.health.counts)
        on = all(each.get("log_on") and not each.get("log_stopped") for each in counts)
        if on and after.received_ns - one.received_ns < MARGIN_NS:
            spans.append((one.received_ns, after.received_ns))
    return spans


def excused_times(outcome: RunOutcome, deleted_ns: Sequence[int]) -> list[Span]:
    """Times at which messages need not be in a take: the log or the network is hit, or a take was deleted with them."""
    spans = []
    for recovery in outcome.recoveries:
        until_ns = recovery.end_ns + int(max(recovery.services_s or PATIENCE_S, 1.0) * 1e9) + MARGIN_NS
        if any(
            fault.hits & {ROUTER, INTEGRATOR} or fault.kind in ("full disk", "requests", "clock")
            for fault in recovery.round.faults
        ):
            spans.append((recovery.begin_ns - MARGIN_NS, until_ns))
    starts = sorted(take.first_ns for take in outcome.takes)
    for time_ns in deleted_ns:  # the deleted file began after the last one before it
        begin_ns = max((take.last_ns for take in outcome.takes if take.last_ns < time_ns), default=0)
        end_ns = min((start for start in starts if start > time_ns), default=time_ns)
        spans.append((begin_ns, end_ns + MARGIN_NS))
    return spans
